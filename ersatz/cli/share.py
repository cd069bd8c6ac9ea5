"""A knowledge base for other systems: linked, exported, served."""

import sys
from pathlib import Path
from typing import Final

import click

from ersatz.cli import options
from ersatz.cli.terminal import open_kb, progress, say
from ersatz.errors import InputError, MissingDependencyError

_SUFFIX: Final = {"knowrob": "owl", "oro": "owl", "classes": "ttl"}


@click.command()
@options.location
@click.argument("out", type=options.PATH, help="The file to write.")
@click.option("--bridge", required=True, help="soma, knowrob, oro, cora, isaac, sosa or prov.")
@click.option(
    "--ontology",
    type=options.PATH,
    multiple=True,
    help="A file of the other ontology, or of one it imports; repeatable.",
)
def link(location: str, out: Path, bridge: str, ontology: tuple[Path, ...]) -> None:
    """Merge the knowledge base, a bridge and another robot ontology into one graph.

    The file opens like any knowledge base: `ersatz query linked.owl linked/...` asks across the border.
    Example: ersatz link household linked.owl --bridge soma --ontology SOMA-HOME.owl --ontology DUL.owl
    """
    from ersatz.knowledge.linking import link as merge
    from ersatz.knowledge.saving import write

    if out.suffix not in (".owl", ".nt"):
        raise InputError(f"{out.name!r}: other ontologies have blank nodes; write a .owl or .nt file")
    store = merge(open_kb(location).triples(), bridge, ontology)
    write((quad.triple for quad in store), out)
    say(f"{out}: {len(store)} triples")


@click.command()
@options.location
@click.argument("out", type=options.PATH, help="The file to write.")
@click.option(
    "--to",
    type=click.Choice(["owl", "ttl", "nt", "jsonld", "knowrob", "oro", "classes", "html"]),
    help="Form, where the file's name does not say it.",
)
def export(location: str, out: Path, to: str | None) -> None:
    """Write the knowledge base as a file in another format, as a directory, or as another system reads it.

    knowrob and oro are for these systems; classes are definitions for a reasoner in Protege; html is a page
    of reference: terms, diagram and questions.
    Example: ersatz export household --to owl household.owl
    """
    from ersatz.knowledge import exports
    from ersatz.knowledge.defined import defined_classes
    from ersatz.knowledge.saving import write
    from ersatz.knowledge.stores import format_of

    kb = open_kb(location)
    ending = "" if to is None else f".{_SUFFIX.get(to, to)}"
    named = (
        out if format_of(out) is not None or out.name.endswith(ending) else out.with_name(out.name + ending)
    )
    if to == "knowrob":
        write(exports.knowrob(kb.triples()), named)
        sys.stdout.write(exports.knowrob_settings(str(named)))
    elif to == "oro":
        write(exports.oro(kb.triples()), named)
    elif to == "classes":
        named.write_text("".join(defined_classes(kb.triples())), encoding="utf-8")
    elif to == "html":
        from ersatz.knowledge.reference import reference

        named.write_text(reference(), encoding="utf-8")
    else:
        kb.save(named)
    say(f"{named}: written")


@click.command()
@options.location
@click.argument("url", help="The endpoint as it will be opened.")
@click.option("--graphs", help="URL of its Graph Store Protocol, where it cannot be guessed.")
@click.option("--update", help="URL changes go to, where it cannot be guessed; only to replace.")
@click.option(
    "--credentials",
    type=options.PATH,
    help="File of logins in netrc's format; else $ERSATZ_CREDENTIALS names it.",
)
@click.option("--replace", is_flag=True, help="Replace the knowledge base that is there, at once.")
@click.option("--piece", default=50_000, help="Triples a request.")
def upload(
    location: str,
    url: str,
    graphs: str | None,
    update: str | None,
    credentials: Path | None,
    replace: bool,
    piece: int,
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


@click.command()
@options.location
@options.host
@options.port
@click.option("--writable", is_flag=True, help="Let who has the token change knowledge.")
@click.option("--token-file", type=options.PATH, help="File with the token, readable by you alone.")
@click.option("--seconds", default=20.0, help="How long one query may take.")
@click.option(
    "--scans", type=options.PATH, help="Folder of the scans it was built from, to be seen on its pages."
)
@click.option(
    "--cors",
    metavar="ORIGIN",
    multiple=True,
    help="Web origin whose scripts may read; repeatable, * for all.",
)
def serve(
    location: str,
    host: str,
    port: int,
    writable: bool,
    token_file: Path | None,
    seconds: float,
    scans: Path | None,
    cors: tuple[str, ...],
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
    settings = ServiceSettings(seconds=seconds, token=token, hosts=hosts_for(host), scans=scans, origins=cors)
    kb = open_kb(location)
    say(f"{kb.location} at http://{host}:{port}/ (SPARQL at /sparql); end with Ctrl-C")
    run(kb, settings, host, port)
