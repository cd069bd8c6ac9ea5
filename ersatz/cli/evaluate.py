"""The experiment: scenarios, survey, agreement."""

import sys
from pathlib import Path

import click

from ersatz.cli import options
from ersatz.cli.terminal import open_kb, progress, say

_scenarios = click.argument("scenarios", help="benchmark, or a file of scenarios (CSV, JSON).")


@click.command()
@options.location
@_scenarios
@click.option(
    "--out", type=options.PATH, required=True, help="Folder to write tables, figures and the report to."
)
@click.option("--baseline", multiple=True, help="A rival, NAME or NAME=FILE; repeatable. Without any: all.")
@click.option("--votes", type=options.PATH, help="Votes of a survey on these scenarios.")
@click.option("--resamples", default=20, help="How often the objects are drawn again.")
@click.option("--workers", default=1, help="Processes.")
def evaluate(
    location: str,
    scenarios: str,
    out: Path,
    baseline: tuple[str, ...],
    votes: Path | None,
    resamples: int,
    workers: int,
) -> None:
    """Compare substitutes with what experts chose, and with rivals: tables, figures, a report.

    Example: ersatz evaluate household benchmark --out results
    """
    from ersatz.evaluation.experiment import run
    from ersatz.evaluation.report import markdown_table, write
    from ersatz.evaluation.scenario_files import load_scenarios
    from ersatz.evaluation.survey import add_votes
    from ersatz.pipeline import ground_blocks

    found = load_scenarios(scenarios)
    found = add_votes(found, votes) if votes is not None else found
    with progress() as report:
        results = run(
            open_kb(location),
            found,
            baselines=baseline,
            ground=ground_blocks,
            resamples=resamples,
            workers=workers,
            progress=report,
        )
    written = write(results, out)
    sys.stdout.write(markdown_table(results))
    say(f"{out}: {len(written)} files; open {written[0]}")


@click.command()
@options.location
@click.argument("out", type=options.PATH, help="CSV or JSON file to write.")
@click.option("--candidates", default=5, help="Objects at hand in each.")
@click.option("--seed", default=0, help="Of the draw.")
def scenarios(location: str, out: Path, candidates: int, seed: int) -> None:
    """Draw one question a class with random objects at hand, as the paper did.

    Example: ersatz scenarios household queries.csv
    """
    from ersatz.evaluation.scenario_files import save_scenarios
    from ersatz.evaluation.scenarios import generate

    drawn = generate(open_kb(location).known_names("class"), candidates, seed)
    save_scenarios(drawn, out)
    say(f"{out}: {len(drawn)} scenarios")


@click.command()
@options.location
@_scenarios
@click.option("--out", type=options.PATH, required=True, help="File the votes are added to.")
@click.option("--pictures", type=options.PATH, help="A folder of scans to draw the objects from.")
@options.host
@options.port
def survey(location: str, scenarios: str, out: Path, pictures: Path | None, host: str, port: int) -> None:
    """Ask experts which object they would take, in the browser; votes are on disk at once.

    Example: ersatz survey household benchmark --out votes.csv
    """
    from ersatz.evaluation.pictures import find_scans
    from ersatz.evaluation.scenario_files import load_scenarios
    from ersatz.evaluation.scenarios import check_names
    from ersatz.evaluation.survey import Survey, VoteFile
    from ersatz.service.survey_pages import create_survey_app, serve_survey

    found, names = load_scenarios(scenarios), open_kb(location).known_names("class")
    check_names(found, names)
    with VoteFile(out) as file:
        asked = create_survey_app(Survey(found, file), find_scans(pictures, names) if pictures else None)
        say(f"{len(found)} questions at http://{host}:{port}/, votes in {out}; end with Ctrl-C")
        serve_survey(asked, host, port)
