"""From measurements to a knowledge base."""

from collections.abc import Sequence
from datetime import UTC, datetime
from os import environ
from pathlib import Path
from typing import Final

import click

from ersatz.cli import options
from ersatz.cli.terminal import console, progress
from ersatz.errors import InputError

SHIPPED_EXPERT: Final = "household"
"""Name of the expert distributions that come with ERSATZ."""


@click.command()
@click.argument(
    "out", type=options.PATH, help="File (.ttl .owl .nt .jsonld, also .gz) or directory to write."
)
@click.option(
    "--tables",
    multiple=True,
    help="A property table, CSV or Parquet, or a directory or URL of Parquet; repeatable.",
)
@click.option("--rocs", type=options.PATH, help="A folder laid out as the RoCS data set.")
@click.option("--scans", type=options.PATH, help="A folder of scans.")
@click.option("--models", multiple=True, help="category=number of parametric models, synthetic; repeatable.")
@click.option("--unlabelled", type=options.PATH, help="A folder of scans to learn shape concepts from.")
@click.option(
    "--concepts", type=options.PATH, help="Shape concepts learned before; without either, the shipped ones."
)
@click.option("--expert", help="Expert distributions (TOML), or household for the shipped ones.")
@click.option("--shape-concepts", default=4, help="How many shape concepts to learn.")
@click.option("--views", default=6, help="Virtual views of an object known from all sides.")
@click.option(
    "--paper-selection", is_flag=True, help="Only the categories and numbers of the paper's Table 1."
)
@click.option("--keep-going", is_flag=True, help="Leave broken scans out.")
@click.option("--workers", default=1, help="Processes that measure scans.")
@click.option("--clusters", default=4, help="Qualities per property, the paper's eta.")
@click.option("--fuzzy", is_flag=True, help="Let values belong to several qualities, to degrees.")
@click.option("--fuzzifier", type=float, help="With --fuzzy: how soft, from 1 (crisp) to 10; 2 unless given.")
@click.option(
    "--unit",
    type=click.Choice(["instance", "observation"]),
    default="instance",
    help="What is counted.",
)
@click.option(
    "--representative",
    default="0.35",
    help="Threshold of the representative qualities written down.",
)
@click.option("--classes-only/--no-classes-only", help="Leave the instances out.")
@click.option("--seed", default=0, help="Of k-means and of the expert's draws.")
@click.option(
    "--scheduler",
    help="Who does the work: a Dask scheduler's address, or local:N processes; else one.",
)
@click.option("--time", help="Time of the build, ISO 8601; else SOURCE_DATE_EPOCH, else none.")
def build(
    out: Path,
    tables: tuple[str, ...],
    rocs: Path | None,
    scans: Path | None,
    models: tuple[str, ...],
    unlabelled: Path | None,
    concepts: Path | None,
    expert: str | None,
    shape_concepts: int,
    views: int,
    paper_selection: bool,
    keep_going: bool,
    workers: int,
    clusters: int,
    fuzzy: bool,
    fuzzifier: float | None,
    unit: str,
    representative: str,
    classes_only: bool,
    seed: int,
    scheduler: str | None,
    time: str | None,
) -> None:
    """Ground a knowledge base in measurements.

    Example: ersatz build kb.ttl --tables objects.csv --expert household
    """
    from ersatz.acquisition.sources import AcquisitionSettings
    from ersatz.grounding.subcategorization import USUAL_FUZZIFIER, SubcategorizationSettings
    from ersatz.grounding.units import ObservationUnit
    from ersatz.knowledge.queries import exact
    from ersatz.pipeline import Settings
    from ersatz.pipeline import build as build_kb
    from ersatz.resources import DATA

    if fuzzifier is not None and not fuzzy:
        raise InputError(f"--fuzzifier {fuzzifier:g} needs --fuzzy: without it qualities are crisp")
    softness = (USUAL_FUZZIFIER if fuzzifier is None else fuzzifier) if fuzzy else 1.0
    source = DATA / "expert.toml" if expert == SHIPPED_EXPERT else expert
    settings = Settings(
        SubcategorizationSettings(clusters, seed=seed, fuzzifier=softness),
        ObservationUnit(unit),
        exact(representative, "representative"),
        AcquisitionSettings(seed, shape_concepts, views, paper_selection, keep_going, workers),
        classes_only=classes_only,
        time=_build_time(time),
    )
    with progress() as report:
        kb = build_kb(
            tables=tables,
            rocs=rocs,
            scans=scans,
            models=_counts(models),
            unlabelled=unlabelled,
            concepts=concepts,
            expert=source,
            settings=settings,
            out=out,
            scheduler=scheduler,
            progress=report,
        )
    classes = kb.ask("classes")
    console(err=True).print(
        f"{out}: {len(classes)} classes, {sum(int(str(row['instances'])) for row in classes)} {unit}s, "
        f"{len(kb.ask('properties'))} properties, {len(kb.ask('qualities'))} qualities; "
        f"revision {kb.revision[:12]}",
        highlight=False,
    )


def _counts(options: Sequence[str]) -> dict[str, int]:
    counts = {}
    for one in options:
        name, _, number = one.partition("=")
        if not number.isdigit() or int(number) < 1:
            raise InputError(f"--models {one!r}: write category=number, such as binder=3")
        counts[name] = int(number)
    return counts


def _build_time(given: str | None) -> str | None:
    """Return the time of the build as xsd:dateTime in UTC, if one is asked for."""
    if given is None and (epoch := environ.get("SOURCE_DATE_EPOCH")):
        if not epoch.isdigit():
            raise InputError(f"SOURCE_DATE_EPOCH is {epoch!r}: give seconds since 1970")
        moment = datetime.fromtimestamp(int(epoch), UTC)
    elif given is None:
        return None
    else:
        try:
            moment = datetime.fromisoformat(given)
        except ValueError:
            raise InputError(f"--time {given!r} is no ISO 8601 time: write 2026-01-31T12:00:00Z") from None
        moment = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
    return moment.strftime("%Y-%m-%dT%H:%M:%SZ")
