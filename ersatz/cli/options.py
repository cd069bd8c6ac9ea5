"""Arguments and options that several commands share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

PATH: Final = click.Path(path_type=Path)
"""A file or a folder; whoever opens it says what is wrong with it."""

location = click.argument(
    "location", metavar="KB", help="household, a file, a directory or an endpoint's URL."
)
missing = click.option("--missing", required=True, help="The missing tool's class.")
available = click.option(
    "--available", multiple=True, help="A class at hand; repeatable. Without any: all classes."
)
instance = click.option("--instance", multiple=True, help="A perceived instance at hand; repeatable.")
graded = click.option(
    "--graded/--no-graded", help="Reason with degrees and weights rather than with what is typical."
)
properties = click.option("--properties", help="paper, or names with commas: reason with these only.")
_REASONING: Final = (
    graded,
    click.option("--representative", default="0.35", help="Theta: typical from this degree on; not graded."),
    click.option("--tolerance", help="Phi: stands in above this similarity; 0.35, ordinal 0.67."),
    click.option("--relevance-tolerance", help="Phi of relevant functions; 0.35, graded 0."),
    click.option(
        "--combine",
        default="union",
        help="union or intersection over relevant functions; not graded.",
    ),
    click.option(
        "--similarity",
        help="jaccard (default), coverage, tversky; graded: ordinal (default), ruzicka too.",
    ),
    click.option(
        "--spacing",
        default="rank",
        help="Of ordinal: qualities are as far apart as rank, centroid, or ratio of centroids.",
    ),
    click.option("--above-lowest/--no-above-lowest", help="Only functions above the lowest degree."),
    click.option("--fallback/--no-fallback", help="With no relevant function, compare all that is typical."),
    properties,
    click.option("--certainty", help="Typical only if the degree is as surely at least theta; such as 0.5."),
)


def reasoning(command: Command) -> Command:
    """Give a command the options that say how substitutes are found."""
    for option in reversed(_REASONING):
        command = option(command)
    return command


as_json = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")
concepts = click.option("--concepts", type=PATH, help="Shape concepts; without them, the shipped ones.")
host = click.option("--host", default="127.0.0.1", help="Address to listen on; loopback unless asked.")
port = click.option("--port", default=8000, help="Port to listen on.")
