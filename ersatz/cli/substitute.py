"""From a knowledge base to substitutes."""

from pathlib import Path
from typing import Any

import click

from ersatz.cli import options
from ersatz.cli.terminal import console, open_kb, print_json, save
from ersatz.errors import InputError


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
@options.reasoning
@click.option("--confidence", is_flag=True, help="Also tell how sure the answer is.")
@click.option("--draws", type=int, help="Of --confidence: how often what is unsure is drawn; 200.")
@click.option("--seed", type=int, help="Of these draws; 0.")
@click.option("--remember/--no-remember", help="Write the answer into the knowledge base.")
@options.as_json
def substitute(
    location: str,
    missing: str,
    available: tuple[str, ...],
    instance: tuple[str, ...],
    confidence: bool,
    draws: int | None,
    seed: int | None,
    remember: bool,
    as_json: bool,
    **chosen: Any,
) -> int:
    """Rank what stands in for a missing tool, with reasons. Exit code 1: undetermined.

    Example: ersatz substitute household --missing tray --available plate --available sponge --graded
    """
    for name, number in (("draws", draws), ("seed", seed)):
        if number is not None and not confidence:
            raise InputError(f"--{name} {number} needs --confidence: without it nothing is drawn")
    kb = open_kb(location, "ersatz.reasoner.substitution", "ersatz.display")
    from ersatz.reasoner.confidence import DRAWS
    from ersatz.reasoner.relevance import ReasonerSettings
    from ersatz.reasoner.substitution import Status, rank_substitutes

    ranking = rank_substitutes(
        kb,
        missing,
        available or None,
        instances=instance,
        settings=ReasonerSettings.written(**chosen),
        remember=remember,
        draws=(DRAWS if draws is None else draws) if confidence else None,
        seed=seed or 0,
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
@click.option("--best", is_flag=True, help="Ask what tells which is the best.")
@options.reasoning
@click.option("--draws", default=1000, help="How often what is unsure is drawn.")
@click.option("--seed", default=0, help="Of these draws.")
@options.as_json
def ask(
    location: str,
    missing: str,
    available: tuple[str, ...],
    instance: tuple[str, ...],
    measured: Path | None,
    best: bool,
    draws: int,
    seed: int,
    as_json: bool,
    **chosen: Any,
) -> None:
    """Tell what to measure before deciding on a substitute: what reduces the doubt most comes first.

    Example: ersatz ask household --missing tray --measured object.toml
    """
    kb = open_kb(location)
    from ersatz.cli.update import read_values
    from ersatz.knowledge.updates import degrees_of, qualities_of
    from ersatz.reasoner.asking import ask_for_more
    from ersatz.reasoner.gain import Doubt
    from ersatz.reasoner.relevance import ReasonerSettings

    settings = ReasonerSettings.written(**chosen)
    told = degrees_of if settings.graded else qualities_of
    wishes = ask_for_more(
        kb,
        missing,
        available or None,
        instances=instance,
        held=None if measured is None else told(kb, read_values(measured, some=False)),
        settings=settings,
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
