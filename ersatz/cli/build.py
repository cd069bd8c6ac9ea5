"""From measurements to a knowledge base."""

from collections.abc import Sequence
from datetime import UTC, datetime
from enum import StrEnum
from os import environ
from pathlib import Path
from typing import Annotated, Final

import typer

from ersatz.cli.app import app
from ersatz.cli.terminal import console, progress
from ersatz.errors import InputError

SHIPPED_EXPERT: Final = "household"
"""Name of the expert distributions that come with ERSATZ."""


class Unit(StrEnum):
    """What is counted."""

    INSTANCE = "instance"
    OBSERVATION = "observation"


@app.command()
def build(
    out: Annotated[
        Path, typer.Argument(help="File (.ttl .owl .nt .jsonld, also .gz) or directory to write.")
    ],
    tables: Annotated[
        list[str] | None,
        typer.Option(help="A property table, CSV or Parquet, or a directory or URL of Parquet; repeatable."),
    ] = None,
    rocs: Annotated[Path | None, typer.Option(help="A folder laid out as the RoCS data set.")] = None,
    scans: Annotated[Path | None, typer.Option(help="A folder of scans.")] = None,
    models: Annotated[
        list[str] | None, typer.Option(help="category=number of parametric models, synthetic; repeatable.")
    ] = None,
    unlabelled: Annotated[
        Path | None, typer.Option(help="A folder of scans to learn shape concepts from.")
    ] = None,
    concepts: Annotated[
        Path | None, typer.Option(help="Shape concepts learned before; without either, the shipped ones.")
    ] = None,
    expert: Annotated[
        str | None, typer.Option(help="Expert distributions (TOML), or household for the shipped ones.")
    ] = None,
    shape_concepts: Annotated[int, typer.Option(help="How many shape concepts to learn.")] = 4,
    views: Annotated[int, typer.Option(help="Virtual views of an object known from all sides.")] = 6,
    paper_selection: Annotated[
        bool,
        typer.Option("--paper-selection", help="Only the categories and numbers of the paper's Table 1."),
    ] = False,
    keep_going: Annotated[bool, typer.Option("--keep-going", help="Leave broken scans out.")] = False,
    workers: Annotated[int, typer.Option(help="Processes that measure scans.")] = 1,
    clusters: Annotated[int, typer.Option(help="Qualities per property, the paper's eta.")] = 4,
    fuzzy: Annotated[
        bool, typer.Option("--fuzzy", help="Let values belong to several qualities, to degrees.")
    ] = False,
    fuzzifier: Annotated[
        float | None, typer.Option(help="With --fuzzy: how soft, from 1 (crisp) to 10; 2 unless given.")
    ] = None,
    unit: Annotated[Unit, typer.Option(help="What is counted.")] = Unit.INSTANCE,
    representative: Annotated[
        str, typer.Option(help="Threshold of the representative qualities written down.")
    ] = "0.35",
    classes_only: Annotated[bool, typer.Option(help="Leave the instances out.")] = False,
    seed: Annotated[int, typer.Option(help="Of k-means and of the expert's draws.")] = 0,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Who does the work: a Dask scheduler's address, or local:N processes; else one."),
    ] = None,
    time: Annotated[
        str | None, typer.Option(help="Time of the build, ISO 8601; else SOURCE_DATE_EPOCH, else none.")
    ] = None,
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
            tables=tables or (),
            rocs=rocs,
            scans=scans,
            models=_counts(models or []),
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
