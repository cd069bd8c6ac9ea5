"""Changing a knowledge base without a refit."""

import json
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ersatz.cli import options
from ersatz.cli.terminal import open_kb, save, say
from ersatz.errors import InputError

if TYPE_CHECKING:
    from ersatz.knowledge.base import KnowledgeBase
    from ersatz.measurements import Block


@click.command()
@options.location
@click.argument("object_class", metavar="CLASS", help="What the object is.")
@click.argument("instance", help="The object's name, new or known.")
@click.option(
    "--measurements",
    type=options.PATH,
    required=True,
    help="JSON or TOML with one value a property, or a property table.",
)
@click.option(
    "--observation",
    default="",
    show_default=False,
    help="Name of the observation, where there are several.",
)
def observe(location: str, object_class: str, instance: str, measurements: Path, observation: str) -> None:
    """Take in what was measured of an object, without a refit.

    Example: ersatz observe kb.ttl plate plate_9 --measurements plate_9.toml
    """
    from ersatz.knowledge.updates import observe_blocks

    kb = open_kb(location)
    if measurements.suffix in (".json", ".toml"):
        kb.observe(object_class, instance, read_values(measurements), observation=observation)
    else:
        observe_blocks(kb, object_class, instance, _table_of(kb, measurements))
    save(kb)
    say(f"{instance}: {len(kb.ask('instance_qualities', instances=[instance]))} qualities")


@click.command()
@options.location
@click.argument("instance", help="The object's name.")
def forget(location: str, instance: str) -> None:
    """Take an object out of the knowledge base and out of all counts.

    Example: ersatz forget kb.ttl plate_9
    """
    kb = open_kb(location)
    kb.forget(instance)
    save(kb)
    say(f"{instance}: forgotten")


def read_values(path: Path, *, some: bool = True) -> dict[str, Any]:
    """Return the values of an object, one a property; at least one, if some."""
    try:
        text = path.read_text(encoding="utf-8")
        values = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"cannot read measurements from {str(path)!r}: {error}") from None
    if not isinstance(values, dict) or (some and not values):
        raise InputError(
            f"{str(path)!r} holds no measurements: give one value a property, such as weight = 0.3"
        )
    return values


def _table_of(kb: "KnowledgeBase", path: Path) -> "list[Block]":
    from ersatz.acquisition.tables import read_table
    from ersatz.knowledge.reader import read_qualities

    return read_table(path, {q.property.name: q.property for q in read_qualities(kb)})
