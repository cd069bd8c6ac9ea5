"""The command line: thin; every command is a call of the library and a way to show its answer."""

import json
import sys
import tomllib
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum
from os import environ
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from ersatz import __version__
from ersatz.errors import ErsatzError, ErsatzWarning, InputError, MissingDependencyError

if TYPE_CHECKING:
    from rich.console import Console

    from ersatz.knowledge.base import KnowledgeBase
    from ersatz.measurements import Block

# Typer has brought its own click since 0.20; what it raises is the parent of what it exports.
_CLICK_ERROR: Final[Any] = next(t for t in typer.BadParameter.__mro__ if t.__name__ == "ClickException")

SHIPPED_EXPERT: Final = "household"
"""Name of the expert distributions that come with ERSATZ."""

app = typer.Typer(
    name="ersatz",
    help="Which of the things at hand can stand in for a missing tool, and why.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

figure_app = typer.Typer(help="Draw scans and shape concepts as PNG files.", rich_markup_mode=None)
app.add_typer(figure_app, name="figure")

Location = Annotated[
    str, typer.Argument(metavar="KB", help="household, a file, a directory or an endpoint's URL.")
]


class Unit(StrEnum):
    """What is counted."""

    INSTANCE = "instance"
    OBSERVATION = "observation"


class TableFormat(StrEnum):
    """How an answer is printed."""

    TABLE = "table"
    JSON = "json"
    CSV = "csv"
    TTL = "ttl"


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


def main() -> None:
    """Run the command line: errors become one line, and exit code 2."""
    warnings.showwarning = _show_warning
    warnings.simplefilter("always", ErsatzWarning)
    try:
        code = app(prog_name="ersatz", standalone_mode=False)
        sys.stdout.flush()
    except typer.Exit as exit_:
        code = exit_.exit_code
    except _CLICK_ERROR as error:
        _fail(f"{error.format_message()} Try `ersatz --help`.")
        code = 2
    except (typer.Abort, KeyboardInterrupt):
        code = 130
    except ErsatzError as error:
        _fail(str(error))
        code = 2
    except BrokenPipeError:
        sys.stderr.close()
        code = 0
    sys.exit(code)


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and end.")] = False,
) -> None:
    if version:
        typer.echo(__version__)
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command()
def demo() -> None:
    """Ask the shipped knowledge base for substitutes of several missing tools.

    Example: ersatz demo
    """
    from ersatz.display import show_ranking
    from ersatz.reasoner.substitution import rank_substitutes

    console, kb = _console(), _open("household")
    for missing, available in (
        ("tray", ["plate", "sponge", "bowl", "binder", "keyboard"]),
        ("coffee mug", ["bowl", "pitcher", "food can", "hand towel", "ball"]),
        ("water bottle", ["soda can", "shampoo", "flashlight", "notebook", "food cup"]),
        ("plate", ["notebook", "cap", "food box", "bowl", "kleenex"]),
    ):
        console.print(f'\n$ ersatz substitute household --missing "{missing}" --available …', style="dim")
        show_ranking(console, rank_substitutes(kb, missing, available))


@app.command()
def build(
    out: Annotated[
        Path, typer.Argument(help="File (.ttl .owl .nt .jsonld, also .gz) or directory to write.")
    ],
    tables: Annotated[
        list[Path] | None, typer.Option(help="A property table, CSV or Parquet; repeatable.")
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
    unit: Annotated[Unit, typer.Option(help="What is counted.")] = Unit.INSTANCE,
    representative: Annotated[
        str, typer.Option(help="Threshold of the representative qualities written down.")
    ] = "0.35",
    classes_only: Annotated[bool, typer.Option(help="Leave the instances out.")] = False,
    seed: Annotated[int, typer.Option(help="Of k-means and of the expert's draws.")] = 0,
    time: Annotated[
        str | None, typer.Option(help="Time of the build, ISO 8601; else SOURCE_DATE_EPOCH, else none.")
    ] = None,
) -> None:
    """Ground a knowledge base in measurements.

    Example: ersatz build kb.ttl --tables objects.csv --expert household
    """
    from ersatz.acquisition.sources import AcquisitionSettings
    from ersatz.grounding.subcategorization import SubcategorizationSettings
    from ersatz.grounding.units import ObservationUnit
    from ersatz.knowledge.queries import exact
    from ersatz.pipeline import Settings
    from ersatz.pipeline import build as build_kb
    from ersatz.resources import DATA

    source = DATA / "expert.toml" if expert == SHIPPED_EXPERT else expert
    settings = Settings(
        SubcategorizationSettings(clusters, seed=seed),
        ObservationUnit(unit),
        exact(representative, "representative"),
        AcquisitionSettings(seed, shape_concepts, views, paper_selection, keep_going, workers),
        classes_only=classes_only,
        time=_build_time(time),
    )
    with _progress() as report:
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
            progress=report,
        )
    counted = sum(int(str(row["instances"])) for row in kb.ask("classes"))
    _console(err=True).print(
        f"{out}: {len(kb.ask('classes'))} classes, {counted} {unit}s, "
        f"{len(kb.ask('properties'))} properties, {len(kb.ask('qualities'))} qualities; "
        f"revision {kb.revision[:12]}",
        highlight=False,
    )


@app.command()
def substitute(
    location: Location,
    missing: Annotated[str, typer.Option(help="The missing tool's class.")],
    available: Annotated[
        list[str] | None, typer.Option(help="A class at hand; repeatable. Without any: all classes.")
    ] = None,
    instance: Annotated[
        list[str] | None, typer.Option(help="A perceived instance at hand; repeatable.")
    ] = None,
    representative: Annotated[str, typer.Option(help="Theta: typical from this degree on.")] = "0.35",
    tolerance: Annotated[str, typer.Option(help="Phi: stands in above this similarity.")] = "0.35",
    relevance_tolerance: Annotated[str, typer.Option(help="Phi of relevant functions.")] = "0.35",
    combine: Annotated[str, typer.Option(help="union or intersection over relevant functions.")] = "union",
    similarity: Annotated[str, typer.Option(help="jaccard, coverage or tversky.")] = "jaccard",
    above_lowest: Annotated[bool, typer.Option(help="Only functions above the lowest degree.")] = False,
    fallback: Annotated[
        bool, typer.Option(help="With no relevant function, compare all that is typical.")
    ] = False,
    properties: Annotated[
        str | None, typer.Option(help="paper, or names with commas: reason with these only.")
    ] = None,
    remember: Annotated[bool, typer.Option(help="Write the answer into the knowledge base.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")] = False,
) -> None:
    """Rank what stands in for a missing tool, with reasons. Exit code 1: undetermined.

    Example: ersatz substitute household --missing tray --available plate --available sponge
    """
    from ersatz.reasoner.relevance import ReasonerSettings
    from ersatz.reasoner.substitution import Status, rank_substitutes

    settings = ReasonerSettings(
        representative,  # type: ignore[arg-type] # thresholds are made exact by the settings
        tolerance,  # type: ignore[arg-type]
        relevance_tolerance,  # type: ignore[arg-type]
        combine,  # type: ignore[arg-type]
        similarity,  # type: ignore[arg-type]
        above_lowest,
        fallback,
        _properties(properties),
    )
    kb = _open(location)
    ranking = rank_substitutes(
        kb, missing, available, instances=instance or (), settings=settings, remember=remember
    )
    if remember and not ranking.reused and ranking.status is Status.OK:
        _save(kb, "the answer is not remembered")
    if as_json:
        _print_json(ranking.to_json())
    else:
        from ersatz.display import show_ranking

        show_ranking(_console(), ranking)
    raise typer.Exit(0 if ranking.status is Status.OK else 1)


@app.command()
def ground(
    location: Location,
    scan: Annotated[Path, typer.Argument(help="A scan of an object: PLY, PCD, OBJ, STL, NPZ, ...")],
    mass: Annotated[float | None, typer.Option(help="Mass in kg, where it was weighed.")] = None,
    concepts: Annotated[
        Path | None, typer.Option(help="The knowledge base's shape concepts, where not beside it.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")] = False,
) -> None:
    """Tell what an unknown object is like, and what it could stand in for.

    Example: ersatz ground household mug.ply
    """
    from ersatz.pipeline import ground as ground_scan

    grounded = ground_scan(_open(location), scan, concepts=concepts, mass=mass)
    if as_json:
        _print_json(grounded.to_json())
    else:
        from ersatz.display import show_grounded

        show_grounded(_console(), grounded)


@figure_app.command("scan")
def figure_scan(
    scan: Annotated[Path, typer.Argument(help="A scan of an object; of a mesh, one view is drawn.")],
    out: Annotated[Path, typer.Option(help="Folder to write the pictures to.")],
    concepts: Annotated[
        Path | None, typer.Option(help="Shape concepts; without them, the shipped ones.")
    ] = None,
) -> None:
    """Draw a scan: its segments, its symbols at each level, the tree of compositions, the responses.

    Example: ersatz figure scan mug.ply --out figures
    """
    from ersatz.acquisition.figures import scan_figures
    from ersatz.acquisition.layouts import FolderSettings, views_of
    from ersatz.acquisition.scans import read_scan
    from ersatz.acquisition.sources import shape_concepts

    view = next(iter(views_of(read_scan(scan), FolderSettings(whole=False))))
    for path in scan_figures(view, shape_concepts(concepts), out):
        _say(f"{path}: written")


@figure_app.command("concepts")
def figure_concepts(
    unlabelled: Annotated[Path, typer.Option(help="The folder of scans the concepts were learned from.")],
    out: Annotated[Path, typer.Option(help="Folder to write the picture to.")],
    concepts: Annotated[
        Path | None, typer.Option(help="Shape concepts; without them, the shipped ones.")
    ] = None,
) -> None:
    """Draw a contact sheet of the shape concepts: one row a concept, its exemplars nearest to its middle.

    Example: ersatz figure concepts --unlabelled scans --out figures
    """
    from ersatz.acquisition.figures import concept_figure
    from ersatz.acquisition.sources import shape_concepts, unlabelled_scans

    out.mkdir(parents=True, exist_ok=True)
    path = concept_figure(shape_concepts(concepts), unlabelled_scans(unlabelled), out / "concepts.png")
    _say(f"{path}: written")


@app.command()
def show(
    location: Location,
    name: Annotated[str | None, typer.Argument(help="A class, instance, property or quality.")] = None,
) -> None:
    """Show what a knowledge base holds, or what it knows of one thing.

    Example: ersatz show household "coffee mug"
    """
    from ersatz.display import show_knowledge, show_thing

    kb = _open(location)
    if name is None:
        show_knowledge(_console(), kb)
    else:
        show_thing(_console(), kb, name)


@app.command()
def observe(
    location: Location,
    object_class: Annotated[str, typer.Argument(metavar="CLASS", help="What the object is.")],
    instance: Annotated[str, typer.Argument(help="The object's name, new or known.")],
    measurements: Annotated[
        Path, typer.Option(help="JSON or TOML with one value a property, or a property table.")
    ],
    observation: Annotated[str, typer.Option(help="Name of the observation, where there are several.")] = "",
) -> None:
    """Take in what was measured of an object, without a refit.

    Example: ersatz observe kb.ttl plate plate_9 --measurements plate_9.toml
    """
    from ersatz.knowledge.updates import observe_blocks

    kb = _open(location)
    if measurements.suffix in (".json", ".toml"):
        kb.observe(object_class, instance, _values(measurements), observation=observation)
    else:
        observe_blocks(kb, object_class, instance, _table_of(kb, measurements))
    _save(kb)
    _say(f"{instance}: {len(kb.ask('instance_qualities', instances=[instance]))} qualities")


@app.command()
def forget(location: Location, instance: Annotated[str, typer.Argument(help="The object's name.")]) -> None:
    """Take an object out of the knowledge base and out of all counts.

    Example: ersatz forget kb.ttl plate_9
    """
    kb = _open(location)
    kb.forget(instance)
    _save(kb)
    _say(f"{instance}: forgotten")


@app.command()
def query(
    location: Location,
    name: Annotated[str | None, typer.Argument(metavar="NAME_OR_FILE", help="Without it: the list.")] = None,
    param: Annotated[list[str] | None, typer.Option(help="name=value; repeatable.")] = None,
    as_format: Annotated[
        TableFormat, typer.Option("--format", help="How to print the answer.")
    ] = TableFormat.TABLE,
) -> None:
    """Ask a stored question, or one of your own in a file.

    Example: ersatz query household class_knowledge --param class=tray
    """
    from ersatz.display import show_questions
    from ersatz.knowledge.queries import query_names, read_query, stored_query

    kb = _open(location)
    if name is None:
        show_questions(_console(), [stored_query(one) for one in query_names() if "/" not in one])
        return
    question = read_query(Path(name)) if name.endswith((".rq", ".sparql")) else stored_query(name)
    _print_answer(kb.answer(question, _arguments(param or [], question.parameters)), as_format)


@app.command()
def check(
    location: Location,
    reason: Annotated[
        bool, typer.Option("--reason", help="Also ask HermiT for contradictions; needs Java.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Look for everything that can be wrong with a knowledge base. Exit code 1: something was found.

    Example: ersatz check kb.ttl --reason
    """
    from ersatz.knowledge.validation import check as check_store
    from ersatz.knowledge.validation import check_file

    path = _path_of(location)
    report = check_file(path, reason) if path is not None else check_store(_open(location).triples(), reason)
    if as_json:
        _print_json(report.as_dict())
    else:
        from ersatz.display import show_report

        show_report(_console(), report)
    raise typer.Exit(0 if report.ok else 1)


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
    store = merge(_open(location).triples(), bridge, ontology or ())
    write((quad.triple for quad in store), out)
    _say(f"{out}: {len(store)} triples")


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

    kb = _open(location)
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
    _say(f"{named}: written")


@app.command()
def serve(
    location: Location,
    host: Annotated[str, typer.Option(help="Address to listen on; loopback unless asked.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on.")] = 8000,
    writable: Annotated[
        bool, typer.Option("--writable", help="Let who has the token change knowledge.")
    ] = False,
    token_file: Annotated[
        Path | None, typer.Option(help="File with the token, readable by you alone.")
    ] = None,
    seconds: Annotated[float, typer.Option(help="How long one query may take.")] = 20.0,
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
    settings = ServiceSettings(seconds=seconds, token=token, hosts=hosts_for(host))
    kb = _open(location)
    _say(f"{kb.location} at http://{host}:{port}/ (SPARQL at /sparql); end with Ctrl-C")
    run(kb, settings, host, port)


@app.command()
def evaluate(
    location: Location,
    scenarios: Annotated[str, typer.Argument(help="benchmark, or a file of scenarios (CSV, JSON).")],
    out: Annotated[Path, typer.Option(help="Folder to write tables, figures and the report to.")],
    baseline: Annotated[
        list[str] | None, typer.Option(help="A rival, NAME or NAME=FILE; repeatable. Without any: all.")
    ] = None,
    votes: Annotated[Path | None, typer.Option(help="Votes of a survey on these scenarios.")] = None,
    resamples: Annotated[int, typer.Option(help="How often the objects are drawn again.")] = 20,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
) -> None:
    """Compare substitutes with what experts chose, and with rivals: tables, figures, a report.

    Example: ersatz evaluate household benchmark --out results
    """
    from ersatz.evaluation.experiment import run
    from ersatz.evaluation.report import markdown_table, write
    from ersatz.evaluation.scenarios import load_scenarios
    from ersatz.evaluation.survey import add_votes
    from ersatz.pipeline import ground_blocks

    found = load_scenarios(scenarios)
    found = add_votes(found, votes) if votes is not None else found
    with _progress() as report:
        results = run(
            _open(location),
            found,
            baselines=baseline or (),
            ground=ground_blocks,
            resamples=resamples,
            workers=workers,
            progress=report,
        )
    written = write(results, out)
    sys.stdout.write(markdown_table(results))
    _say(f"{out}: {len(written)} files; open {written[0]}")


@app.command("scenarios")
def draw_scenarios(
    location: Location,
    out: Annotated[Path, typer.Argument(help="CSV or JSON file to write.")],
    candidates: Annotated[int, typer.Option(help="Objects at hand in each.")] = 5,
    seed: Annotated[int, typer.Option(help="Of the draw.")] = 0,
) -> None:
    """Draw one question a class with random objects at hand, as the paper did.

    Example: ersatz scenarios household queries.csv
    """
    from ersatz.evaluation.scenarios import generate, save_scenarios

    drawn = generate(_open(location).known_names("class"), candidates, seed)
    save_scenarios(drawn, out)
    _say(f"{out}: {len(drawn)} scenarios")


@app.command()
def survey(
    location: Location,
    scenarios: Annotated[str, typer.Argument(help="benchmark, or a file of scenarios (CSV, JSON).")],
    out: Annotated[Path, typer.Option(help="File the votes are added to.")],
    pictures: Annotated[Path | None, typer.Option(help="A folder of scans to draw the objects from.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen on; loopback unless asked.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on.")] = 8000,
) -> None:
    """Ask experts which object they would take, in the browser; votes are on disk at once.

    Example: ersatz survey household benchmark --out votes.csv
    """
    from ersatz.evaluation.pictures import find_scans
    from ersatz.evaluation.scenarios import check_names, load_scenarios
    from ersatz.evaluation.survey import Survey, VoteFile
    from ersatz.service.survey_pages import create_survey_app, serve_survey

    found, names = load_scenarios(scenarios), _open(location).known_names("class")
    check_names(found, names)
    with VoteFile(out) as file:
        asked = create_survey_app(Survey(found, file), find_scans(pictures, names) if pictures else None)
        _say(f"{len(found)} questions at http://{host}:{port}/, votes in {out}; end with Ctrl-C")
        serve_survey(asked, host, port)


def _open(location: str) -> "KnowledgeBase":
    from ersatz.knowledge.base import KnowledgeBase

    return KnowledgeBase.open(location)


def _path_of(location: str) -> Path | None:
    """Return the file a knowledge base is in, if it is in one."""
    from ersatz.knowledge.base import SHIPPED
    from ersatz.resources import ONTOLOGY

    path = ONTOLOGY / f"{location}.ttl" if location in SHIPPED else Path(location)
    return path if path.is_file() and path.suffix != ".gz" else None


def _save(kb: "KnowledgeBase", otherwise: str = "") -> None:
    """Write a changed file back; where that cannot be and need not be, say so."""
    try:
        kb.save()
    except ErsatzError as error:
        if not otherwise:
            raise
        warnings.warn(f"{otherwise}: {error}", ErsatzWarning, stacklevel=2)


def _counts(options: Sequence[str]) -> dict[str, int]:
    counts = {}
    for one in options:
        name, _, number = one.partition("=")
        if not number.isdigit() or int(number) < 1:
            raise InputError(f"--models {one!r}: write category=number, such as binder=3")
        counts[name] = int(number)
    return counts


def _properties(names: str | None) -> tuple[str, ...] | None:
    from ersatz.reasoner.relevance import PAPER_PROPERTIES

    if names is None:
        return None
    return PAPER_PROPERTIES if names == "paper" else tuple(name.strip() for name in names.split(","))


def _values(path: Path) -> dict[str, Any]:
    try:
        text = path.read_text(encoding="utf-8")
        values = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"cannot read measurements from {str(path)!r}: {error}") from None
    if not isinstance(values, dict) or not values:
        raise InputError(
            f"{str(path)!r} holds no measurements: give one value a property, such as weight = 0.3"
        )
    return values


def _table_of(kb: "KnowledgeBase", path: Path) -> "list[Block]":
    from ersatz.acquisition.tables import read_table
    from ersatz.knowledge.updates import read_qualities

    return read_table(path, {q.property.name: q.property for q in read_qualities(kb)})


def _arguments(params: Sequence[str], kinds: Any) -> dict[str, Any]:
    arguments: dict[str, Any] = {}
    for one in params:
        name, equals, value = one.partition("=")
        if not equals:
            raise InputError(f"--param {one!r}: write name=value")
        arguments[name] = value.split(",") if kinds.get(name) == "iris" else value
    return arguments


def _print_answer(answer: Any, as_format: TableFormat) -> None:
    if as_format is TableFormat.JSON:
        _print_json([{name: _plain(value) for name, value in row.items()} for row in answer])
    elif as_format is TableFormat.CSV:
        import csv

        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(answer.variables)
        writer.writerows([["" if value is None else value for value in row] for row in answer.rows])
    elif as_format is TableFormat.TTL:
        sys.stdout.write(answer.to_turtle())
    else:
        from ersatz.display import answer_table

        _console().print(answer_table(answer))


def _plain(value: Any) -> Any:
    """Return a value in JSON's types; decimals as numbers."""
    from decimal import Decimal

    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    return value


def _print_json(value: Any) -> None:
    sys.stdout.write(json.dumps(value, indent=2, ensure_ascii=False) + "\n")


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


@contextmanager
def _progress() -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar on a terminal; elsewhere nothing."""
    from rich.progress import Progress

    console = _console(err=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage, completed=share)


def _console(*, err: bool = False) -> "Console":
    from rich.console import Console

    return Console(stderr=err)


def _say(message: str) -> None:
    sys.stderr.write(f"{message}\n")


def _fail(message: str) -> None:
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(message.split()))
    sys.stderr.write(f"error: {line}\n")


def _show_warning(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    if issubclass(category, ErsatzWarning):
        sys.stderr.write(f"warning: {message}\n")
