"""From a knowledge base to substitutes."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ersatz.cli.app import app
from ersatz.cli.options import AsJson, Available, Graded, Instances, Location, Missing, Properties
from ersatz.cli.terminal import console, open_kb, print_json, save
from ersatz.cli.update import read_values


@app.command()
def demo() -> None:
    """Ask the shipped knowledge base for substitutes of several missing tools.

    Example: ersatz demo
    """
    from ersatz.display import show_ranking
    from ersatz.reasoner.substitution import rank_substitutes

    terminal, kb = console(), open_kb("household")
    for missing, available in (
        ("tray", ["plate", "sponge", "bowl", "binder", "keyboard"]),
        ("coffee mug", ["bowl", "pitcher", "food can", "hand towel", "ball"]),
        ("water bottle", ["soda can", "shampoo", "flashlight", "notebook", "food cup"]),
        ("plate", ["notebook", "cap", "food box", "bowl", "kleenex"]),
    ):
        terminal.print(f'\n$ ersatz substitute household --missing "{missing}" --available …', style="dim")
        show_ranking(terminal, rank_substitutes(kb, missing, available))


@app.command()
def substitute(
    location: Location,
    missing: Missing,
    available: Available = None,
    instance: Instances = None,
    graded: Graded = False,
    representative: Annotated[
        str, typer.Option(help="Theta: typical from this degree on; not graded.")
    ] = "0.35",
    tolerance: Annotated[
        str | None, typer.Option(help="Phi: stands in above this similarity; 0.35, ordinal 0.67.")
    ] = None,
    relevance_tolerance: Annotated[
        str | None, typer.Option(help="Phi of relevant functions; 0.35, graded 0.")
    ] = None,
    combine: Annotated[
        str, typer.Option(help="union or intersection over relevant functions; not graded.")
    ] = "union",
    similarity: Annotated[
        str | None,
        typer.Option(help="jaccard (default), coverage, tversky; graded: ordinal (default), ruzicka too."),
    ] = None,
    spacing: Annotated[
        str, typer.Option(help="Of ordinal: qualities are as far apart as ranks or as centroids.")
    ] = "rank",
    above_lowest: Annotated[bool, typer.Option(help="Only functions above the lowest degree.")] = False,
    fallback: Annotated[
        bool, typer.Option(help="With no relevant function, compare all that is typical.")
    ] = False,
    properties: Properties = None,
    certainty: Annotated[
        str | None,
        typer.Option(help="Typical only if the degree is as surely at least theta; such as 0.5."),
    ] = None,
    confidence: Annotated[
        bool, typer.Option("--confidence", help="Also tell how sure the answer is.")
    ] = False,
    draws: Annotated[int, typer.Option(help="Of --confidence: how often what is unsure is drawn.")] = 200,
    seed: Annotated[int, typer.Option(help="Of these draws.")] = 0,
    remember: Annotated[bool, typer.Option(help="Write the answer into the knowledge base.")] = False,
    as_json: AsJson = False,
) -> None:
    """Rank what stands in for a missing tool, with reasons. Exit code 1: undetermined.

    Example: ersatz substitute household --missing tray --available plate --available sponge --graded
    """
    from ersatz.reasoner.relevance import ReasonerSettings
    from ersatz.reasoner.substitution import Status, rank_substitutes

    chosen: dict[str, Any] = {
        "representative": representative,
        "tolerance": tolerance,
        "relevance_tolerance": relevance_tolerance,
        "combine": combine,
        "similarity": similarity,
        "spacing": spacing,
        "certainty": certainty,
        "properties": _properties(properties),
    }
    given = {name: value for name, value in chosen.items() if value is not None}
    settings = ReasonerSettings(above_lowest=above_lowest, fallback=fallback, graded=graded, **given)
    kb = open_kb(location)
    ranking = rank_substitutes(
        kb,
        missing,
        available,
        instances=instance or (),
        settings=settings,
        remember=remember,
        draws=draws if confidence else None,
        seed=seed,
    )
    if remember and (confidence or not ranking.reused) and ranking.status is Status.OK:
        save(kb, "the answer is not remembered")
    if as_json:
        print_json(ranking.to_json())
    else:
        from ersatz.display import show_ranking

        show_ranking(console(), ranking)
    raise typer.Exit(0 if ranking.status is Status.OK else 1)


@app.command()
def ask(
    location: Location,
    missing: Missing,
    available: Available = None,
    instance: Instances = None,
    measured: Annotated[
        Path | None,
        typer.Option(help="What is known so far of one unknown object: JSON or TOML, may be empty."),
    ] = None,
    graded: Graded = False,
    best: Annotated[bool, typer.Option("--best", help="Ask what tells which is the best.")] = False,
    properties: Properties = None,
    draws: Annotated[int, typer.Option(help="How often what is unsure is drawn.")] = 1000,
    seed: Annotated[int, typer.Option(help="Of these draws.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Tell what to measure before deciding on a substitute: what reduces the doubt most comes first.

    Example: ersatz ask household --missing tray --measured object.toml
    """
    from ersatz.knowledge.updates import qualities_of
    from ersatz.reasoner.asking import ask_for_more
    from ersatz.reasoner.gain import Doubt
    from ersatz.reasoner.relevance import ReasonerSettings

    kb = open_kb(location)
    wishes = ask_for_more(
        kb,
        missing,
        available,
        instances=instance or (),
        held=None if measured is None else qualities_of(kb, read_values(measured, some=False)),
        settings=ReasonerSettings(properties=_properties(properties), graded=graded),
        about=Doubt.BEST if best else Doubt.ACCEPTED,
        draws=draws,
        seed=seed,
    )
    if as_json:
        print_json(wishes.to_json())
    else:
        from ersatz.display import show_wishes

        show_wishes(console(), wishes)


@app.command()
def ground(
    location: Location,
    scan: Annotated[Path, typer.Argument(help="A scan of an object: PLY, PCD, OBJ, STL, NPZ, ...")],
    mass: Annotated[float | None, typer.Option(help="Mass in kg, where it was weighed.")] = None,
    concepts: Annotated[
        Path | None, typer.Option(help="The knowledge base's shape concepts, where not beside it.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Tell what an unknown object is like, and what it could stand in for.

    Example: ersatz ground household mug.ply
    """
    from ersatz.pipeline import ground as ground_scan

    grounded = ground_scan(open_kb(location), scan, concepts=concepts, mass=mass)
    if as_json:
        print_json(grounded.to_json())
    else:
        from ersatz.display import show_grounded

        show_grounded(console(), grounded)


def _properties(names: str | None) -> tuple[str, ...] | None:
    from ersatz.reasoner.relevance import PAPER_PROPERTIES

    if names is None:
        return None
    return PAPER_PROPERTIES if names == "paper" else tuple(name.strip() for name in names.split(","))
