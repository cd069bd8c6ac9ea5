"""The experiment: scenarios, survey, agreement."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from ersatz.cli.app import app
from ersatz.cli.options import Host, Location, Port
from ersatz.cli.terminal import open_kb, progress, say


@app.command()
def evaluate(
    location: Location,
    scenarios: Annotated[str, typer.Argument(help="benchmark, or a file of scenarios (CSV, JSON).")],
    out: Annotated[Path, typer.Option(help="Folder to write tables, figures and the report to.")],
    baseline: Annotated[
        list[str] | None, typer.Option(help="A rival, NAME or NAME=FILE; repeatable. Without any: all.")
    ] = None,
    votes: Annotated[Path | None, typer.Option(help="Votes of a survey on these scenarios.")] = None,
    resamples: Annotated[int, typer.Option(help="How often the objects are drawn again.")] = 20,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
) -> None:
    """Compare substitutes with what experts chose, and with rivals: tables, figures, a report.

    Example: ersatz evaluate household benchmark --out results
    """
    from ersatz.evaluation.experiment import run
    from ersatz.evaluation.report import markdown_table, write
    from ersatz.evaluation.scenarios import load_scenarios
    from ersatz.evaluation.survey import add_votes
    from ersatz.pipeline import ground_blocks

    found = load_scenarios(scenarios)
    found = add_votes(found, votes) if votes is not None else found
    with progress() as report:
        results = run(
            open_kb(location),
            found,
            baselines=baseline or (),
            ground=ground_blocks,
            resamples=resamples,
            workers=workers,
            progress=report,
        )
    written = write(results, out)
    sys.stdout.write(markdown_table(results))
    say(f"{out}: {len(written)} files; open {written[0]}")


@app.command("scenarios")
def draw_scenarios(
    location: Location,
    out: Annotated[Path, typer.Argument(help="CSV or JSON file to write.")],
    candidates: Annotated[int, typer.Option(help="Objects at hand in each.")] = 5,
    seed: Annotated[int, typer.Option(help="Of the draw.")] = 0,
) -> None:
    """Draw one question a class with random objects at hand, as the paper did.

    Example: ersatz scenarios household queries.csv
    """
    from ersatz.evaluation.scenarios import generate, save_scenarios

    drawn = generate(open_kb(location).known_names("class"), candidates, seed)
    save_scenarios(drawn, out)
    say(f"{out}: {len(drawn)} scenarios")


@app.command()
def survey(
    location: Location,
    scenarios: Annotated[str, typer.Argument(help="benchmark, or a file of scenarios (CSV, JSON).")],
    out: Annotated[Path, typer.Option(help="File the votes are added to.")],
    pictures: Annotated[Path | None, typer.Option(help="A folder of scans to draw the objects from.")] = None,
    host: Host = "127.0.0.1",
    port: Port = 8000,
) -> None:
    """Ask experts which object they would take, in the browser; votes are on disk at once.

    Example: ersatz survey household benchmark --out votes.csv
    """
    from ersatz.evaluation.pictures import find_scans
    from ersatz.evaluation.scenarios import check_names, load_scenarios
    from ersatz.evaluation.survey import Survey, VoteFile
    from ersatz.service.survey_pages import create_survey_app, serve_survey

    found, names = load_scenarios(scenarios), open_kb(location).known_names("class")
    check_names(found, names)
    with VoteFile(out) as file:
        asked = create_survey_app(Survey(found, file), find_scans(pictures, names) if pictures else None)
        say(f"{len(found)} questions at http://{host}:{port}/, votes in {out}; end with Ctrl-C")
        serve_survey(asked, host, port)
