"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

Location = Annotated[
    str, typer.Argument(metavar="KB", help="household, a file, a directory or an endpoint's URL.")
]
Missing = Annotated[str, typer.Option(help="The missing tool's class.")]
Available = Annotated[
    list[str] | None, typer.Option(help="A class at hand; repeatable. Without any: all classes.")
]
Instances = Annotated[list[str] | None, typer.Option(help="A perceived instance at hand; repeatable.")]
Graded = Annotated[
    bool, typer.Option(help="Reason with degrees and weights rather than with what is typical.")
]
Properties = Annotated[str | None, typer.Option(help="paper, or names with commas: reason with these only.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")]
Concepts = Annotated[Path | None, typer.Option(help="Shape concepts; without them, the shipped ones.")]
Host = Annotated[str, typer.Option(help="Address to listen on; loopback unless asked.")]
Port = Annotated[int, typer.Option(help="Port to listen on.")]
