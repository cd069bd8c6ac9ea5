"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Final

import click

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
as_json = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")
concepts = click.option("--concepts", type=PATH, help="Shape concepts; without them, the shipped ones.")
host = click.option("--host", default="127.0.0.1", help="Address to listen on; loopback unless asked.")
port = click.option("--port", default=8000, help="Port to listen on.")
