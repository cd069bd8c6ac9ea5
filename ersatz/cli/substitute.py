"""From a knowledge base to substitutes."""

from pathlib import Path
from typing import Any

import click

from ersatz.cli import options
from ersatz.cli.terminal import console, open_kb, print_json, save


@click.command()
def demo() -> None:
    """Ask the shipped knowledge base for substitutes of several missing tools.

    Example: ersatz demo
    """
    terminal, kb = console(), open_kb("household")
    from ersatz.display import show_ranking
    from ersatz.reasoner.substitution import rank_substitutes

    for missing, available in (
        ("tray", ["plate", "sponge", "bowl", "binder", "keyboard"]),
        ("coffee mug", ["bowl", "pitcher", "food can", "hand towel", "ball"]),
        ("water bottle", ["soda can", "shampoo", "flashlight", "notebook", "food cup"]),
        ("plate", ["notebook", "cap", "food box", "bowl", "kleenex"]),
    ):
        terminal.print(f'\n$ ersatz substitute household --missing "{missing}" --available …', style="dim")
        show_ranking(terminal, rank_substitutes(kb, missing, available))


@click.command()
@options.location
@options.missing
@options.available
@options.instance
@options.graded
@click.option("--representative", default="0.35", help="Theta: typical from this degree on; not graded.")
@click.option("--tolerance", help="Phi: stands in above this similarity; 0.35, ordinal 0.67.")
@click.option("--relevance-tolerance", help="Phi of relevant functions; 0.35, graded 0.")
@click.option(
    "--combine",
    default="union",
    help="union or intersection over relevant functions; not graded.",
)
@click.option(
    "--similarity",
    help="jaccard (default), coverage, tversky; graded: ordinal (default), ruzicka too.",
)
@click.option(
    "--spacing",
    default="rank",
    help="Of ordinal: qualities are as far apart as rank, centroid, or ratio of centroids.",
)
@click.option("--above-lowest/--no-above-lowest", help="Only functions above the lowest degree.")
@click.option("--fallback/--no-fallback", help="With no relevant function, compare all that is typical.")
@options.properties
@click.option("--certainty", help="Typical only if the degree is as surely at least theta; such as 0.5.")
@click.option("--confidence", is_flag=True, help="Also tell how sure the answer is.")
@click.option("--draws", default=200, help="Of --confidence: how often what is unsure is drawn.")
@click.option("--seed", default=0, help="Of these draws.")
@click.option("--remember/--no-remember", help="Write the answer into the knowledge base.")
@options.as_json
def substitute(
    location: str,
    missing: str,
    available: tuple[str, ...],
    instance: tuple[str, ...],
    above_lowest: bool,
    fallback: bool,
    graded: bool,
    properties: str | None,
    confidence: bool,
    draws: int,
    seed: int,
    remember: bool,
    as_json: bool,
    **chosen: Any,
) -> int:
    """Rank what stands in for a missing tool, with reasons. Exit code 1: undetermined.

    Example: ersatz substitute household --missing tray --available plate --available sponge --graded
    """
    kb = open_kb(location, "ersatz.reasoner.substitution", "ersatz.display")
    from ersatz.reasoner.relevance import ReasonerSettings
    from ersatz.reasoner.substitution import Status, rank_substitutes

    # What is not given has a default that depends on the rest.
    given = {name: value for name, value in chosen.items() if value is not None}
    settings = ReasonerSettings(
        above_lowest=above_lowest,
        fallback=fallback,
        graded=graded,
        properties=_properties(properties),
        **given,
    )
    ranking = rank_substitutes(
        kb,
        missing,
        available or None,
        instances=instance,
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
    return 0 if ranking.status is Status.OK else 1


@click.command()
@options.location
@options.missing
@options.available
@options.instance
@click.option(
    "--measured",
    type=options.PATH,
    help="What is known so far of one unknown object: JSON or TOML, may be empty.",
)
@options.graded
@click.option("--best", is_flag=True, help="Ask what tells which is the best.")
@options.properties
@click.option("--draws", default=1000, help="How often what is unsure is drawn.")
@click.option("--seed", default=0, help="Of these draws.")
@options.as_json
def ask(
    location: str,
    missing: str,
    available: tuple[str, ...],
    instance: tuple[str, ...],
    measured: Path | None,
    graded: bool,
    best: bool,
    properties: str | None,
    draws: int,
    seed: int,
    as_json: bool,
) -> None:
    """Tell what to measure before deciding on a substitute: what reduces the doubt most comes first.

    Example: ersatz ask household --missing tray --measured object.toml
    """
    kb = open_kb(location)
    from ersatz.cli.update import read_values
    from ersatz.knowledge.updates import qualities_of
    from ersatz.reasoner.asking import ask_for_more
    from ersatz.reasoner.gain import Doubt
    from ersatz.reasoner.relevance import ReasonerSettings

    wishes = ask_for_more(
        kb,
        missing,
        available or None,
        instances=instance,
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


@click.command()
@options.location
@click.argument("scan", type=options.PATH, help="A scan of an object: PLY, PCD, OBJ, STL, NPZ, ...")
@click.option("--mass", type=float, help="Mass in kg, where it was weighed.")
@click.option(
    "--concepts", type=options.PATH, help="The knowledge base's shape concepts, where not beside it."
)
@options.as_json
def ground(location: str, scan: Path, mass: float | None, concepts: Path | None, as_json: bool) -> None:
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
