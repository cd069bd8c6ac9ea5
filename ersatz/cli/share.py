"""A knowledge base for other systems: linked, exported, served."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final

import typer

from ersatz.cli.app import app
from ersatz.cli.options import Host, Location, Port
from ersatz.cli.terminal import open_kb, progress, say
from ersatz.errors import InputError, MissingDependencyError


class ExportForm(StrEnum):
    """Forms of `export`."""

    OWL = "owl"
    TTL = "ttl"
    NT = "nt"
    JSONLD = "jsonld"
    KNOWROB = "knowrob"
    ORO = "oro"
    CLASSES = "classes"
    HTML = "html"


_SUFFIX: Final = {ExportForm.KNOWROB: "owl", ExportForm.ORO: "owl", ExportForm.CLASSES: "ttl"}


@app.command()
def link(
    location: Location,
    out: Annotated[Path, typer.Argument(help="The file to write.")],
    bridge: Annotated[str, typer.Option(help="soma, knowrob, oro, cora, isaac, sosa or prov.")],
    ontology: Annotated[
        list[Path] | None,
        typer.Option(help="A file of the other ontology, or of one it imports; repeatable."),
    ] = None,
) -> None:
    """Merge the knowledge base, a bridge and another robot ontology into one graph.

    The file opens like any knowledge base: `ersatz query linked.owl linked/...` asks across the border.
    Example: ersatz link household linked.owl --bridge soma --ontology SOMA-HOME.owl --ontology DUL.owl
    """
    from ersatz.knowledge.base import write
    from ersatz.knowledge.linking import link as merge

    if out.suffix not in (".owl", ".nt"):
        raise InputError(f"{out.name!r}: other ontologies have blank nodes; write a .owl or .nt file")
    store = merge(open_kb(location).triples(), bridge, ontology or ())
    write((quad.triple for quad in store), out)
    say(f"{out}: {len(store)} triples")


@app.command()
def export(
    location: Location,
    out: Annotated[Path, typer.Argument(help="The file to write.")],
    to: Annotated[
        ExportForm | None, typer.Option(help="Form, where the file's name does not say it.")
    ] = None,
) -> None:
    """Write the knowledge base as a file in another format, as a directory, or as another system reads it.

    knowrob and oro are for these systems; classes are definitions for a reasoner in Protege; html is a page
    of reference: terms, diagram and questions.
    Example: ersatz export household --to owl household.owl
    """
    from ersatz.knowledge import exports
    from ersatz.knowledge.base import write
    from ersatz.knowledge.defined import defined_classes
    from ersatz.knowledge.stores import format_of

    kb = open_kb(location)
    ending = "" if to is None else f".{_SUFFIX.get(to, to)}"
    named = (
        out if format_of(out) is not None or out.name.endswith(ending) else out.with_name(out.name + ending)
    )
    if to is ExportForm.KNOWROB:
        write(exports.knowrob(kb.triples()), named)
        sys.stdout.write(exports.knowrob_settings(str(named)))
    elif to is ExportForm.ORO:
        write(exports.oro(kb.triples()), named)
    elif to is ExportForm.CLASSES:
        named.write_text("".join(defined_classes(kb.triples())), encoding="utf-8")
    elif to is ExportForm.HTML:
        from ersatz.knowledge.reference import reference

        named.write_text(reference(), encoding="utf-8")
    else:
        kb.save(named)
    say(f"{named}: written")


@app.command()
def upload(
    location: Location,
    url: Annotated[str, typer.Argument(help="The endpoint as it will be opened.")],
    graphs: Annotated[
        str | None, typer.Option(help="URL of its Graph Store Protocol, where it cannot be guessed.")
    ] = None,
    update: Annotated[
        str | None, typer.Option(help="URL changes go to, where it cannot be guessed; only to replace.")
    ] = None,
    credentials: Annotated[
        Path | None, typer.Option(help="File of logins in netrc's format; else $ERSATZ_CREDENTIALS names it.")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace the knowledge base that is there, at once.")
    ] = False,
    piece: Annotated[int, typer.Option(help="Triples a request.")] = 50_000,
) -> None:
    """Send the knowledge base to a SPARQL server, as its home or as a copy; go on with a broken upload.

    Nobody takes it for a knowledge base before all of it has arrived.
    Example: ersatz upload kb 'http://server:7878/query?default-graph-uri=urn:fleet'
    """
    from ersatz.knowledge.upload import UploadSettings
    from ersatz.knowledge.upload import upload as send

    settings = UploadSettings(graphs, update, credentials, replace, piece)
    with open_kb(location) as kb, progress() as report:
        triples = send(kb, url, settings, report)
        say(f"{url}: {triples} triples, revision {kb.revision[:12]}")


@app.command()
def serve(
    location: Location,
    host: Host = "127.0.0.1",
    port: Port = 8000,
    writable: Annotated[
        bool, typer.Option("--writable", help="Let who has the token change knowledge.")
    ] = False,
    token_file: Annotated[
        Path | None, typer.Option(help="File with the token, readable by you alone.")
    ] = None,
    seconds: Annotated[float, typer.Option(help="How long one query may take.")] = 20.0,
    scans: Annotated[
        Path | None, typer.Option(help="Folder of the scans it was built from, to be seen on its pages.")
    ] = None,
    cors: Annotated[
        list[str] | None,
        typer.Option(metavar="ORIGIN", help="Web origin whose scripts may read; repeatable, * for all."),
    ] = None,
) -> None:
    """Serve the knowledge base: pages to look into it, and a SPARQL 1.1 endpoint.

    Example: ersatz serve household --port 8000
    """
    try:
        from ersatz.service.server import hosts_for
        from ersatz.service.server import serve as run
        from ersatz.service.settings import ServiceSettings, read_token
    except ModuleNotFoundError as error:
        raise MissingDependencyError(f"serving needs {error.name}: install ersatz[serve]") from None
    if writable != (token_file is not None):
        raise InputError("--writable and --token-file go together: only who has the token may write")
    token = read_token(token_file) if token_file is not None else None
    settings = ServiceSettings(
        seconds=seconds, token=token, hosts=hosts_for(host), scans=scans, origins=tuple(cors or ())
    )
    kb = open_kb(location)
    say(f"{kb.location} at http://{host}:{port}/ (SPARQL at /sparql); end with Ctrl-C")
    run(kb, settings, host, port)
