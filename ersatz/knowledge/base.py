"""KnowledgeBase: open, ask, tell, save; the same behind a file, a directory and a remote endpoint."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

import pyoxigraph as ox

from ersatz.errors import InputError, KnowledgeBaseError
from ersatz.knowledge import lookup
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.answers import Answer, answer_of
from ersatz.knowledge.directory import DirectoryStore
from ersatz.knowledge.models import SubstitutionModel
from ersatz.knowledge.opening import SHIPPED, open_store
from ersatz.knowledge.queries import Argument, Query, refuse_foreign_access, stored_query
from ersatz.knowledge.revision import revision_line, revision_of
from ersatz.knowledge.saving import check_target, with_revision, write
from ersatz.knowledge.shelf import subjects
from ersatz.knowledge.stores import MemoryStore, Store, format_of, load_own, one_line
from ersatz.measurements import Origin, Source
from ersatz.resources import ONTOLOGY

if TYPE_CHECKING:
    import rdflib

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Build:
    """How the knowledge base came about, as it says of itself."""

    unit: str
    theta: str
    settings: str
    software: str


@dataclass(frozen=True, slots=True, eq=False)
class View(Generic[T]):
    """How something is made of a knowledge base, where it can be brought up to date after a change.

    Attributes
    ----------
    load : function
    refresh : function
        Of what was made before, the knowledge base, and the IRIs of the subjects of all triples added
        or removed since; returns None to have all loaded anew.
    """

    load: Callable[["KnowledgeBase"], T]
    refresh: Callable[[T, "KnowledgeBase", frozenset[str]], T | None]

    def __call__(self, kb: "KnowledgeBase") -> T:
        """Make it."""
        return self.load(kb)


class KnowledgeBase:
    """Grounded knowledge of objects, kept as OWL.

    Reading never writes, but for what `shelf` keeps. What changes knowledge goes through `observe`,
    `forget` and `tell`; a file is changed in memory until `save`, a directory or an endpoint at once.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._views: dict[object, Any] = {}
        self._outdated: dict[View[Any], tuple[Any, set[str]]] = {}
        rows = self.ask("build")
        if not rows:
            raise KnowledgeBaseError(
                f"{store.location!r} holds no ERSATZ knowledge base, for it has no build record: "
                "make one with `ersatz build`"
            )
        if rows[0]["format"] != v.FORMAT_VERSION:
            raise KnowledgeBaseError(
                f"{store.location!r} is of format {rows[0]['format']}, this ERSATZ reads {v.FORMAT_VERSION}: "
                "build it again with this version"
            )
        row = rows[0]
        self.build: Final = Build(
            *(str(row[name] or "") for name in ("unit", "theta", "settings", "software"))
        )
        self.revision = str(row["revision"])

    @classmethod
    def open(cls, location: str | Path, *, update: str | None = None) -> "KnowledgeBase":
        """Open a knowledge base.

        Parameters
        ----------
        location : str or Path
            "household" (shipped), a file (.ttl, .owl, .rdf, .nt, .jsonld, each also .gz), a directory
            made by `save`, or the URL of a SPARQL 1.1 endpoint.
        update : str, optional
            The URL changes go to, where an endpoint has another one for them.

        Raises
        ------
        KnowledgeBaseError
            If there is nothing, it is damaged, or it is no knowledge base of this format.
        """
        return cls(open_store(location, update))

    @classmethod
    def create(cls, lines: Iterable[str], path: Path | None = None) -> "KnowledgeBase":
        """Make a knowledge base from lines of N-Triples and write down its revision.

        Without a path it lives in memory; with one it is written as a file or, where the name has no
        suffix, as a directory, streaming: nothing is left there unless all was written.
        """
        if path is not None and format_of(path) is None:
            check_target(path)
            DirectoryStore.create(path, with_revision(lines))
            return cls(DirectoryStore(path))
        engine = ox.Store()
        for chunk in with_revision(lines):
            load_own(engine, chunk)
        kb = cls(MemoryStore(engine, str(path or "a knowledge base in memory")))
        if path is not None:
            write(kb.triples(), path)
        return kb

    @property
    def shelf(self) -> Path | None:
        """The folder of a directory's snapshot, where what is made of what it holds may be kept."""
        return self._store.snapshot if isinstance(self._store, DirectoryStore) else None

    @property
    def location(self) -> str:
        """Where it was opened."""
        return self._store.location

    def __enter__(self) -> "KnowledgeBase":
        """Return itself; it is closed at the end of the block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def close(self) -> None:
        """Release files and locks."""
        self._store.close()

    def ask(self, name: str, /, **arguments: Argument) -> Answer:
        """Answer a stored question of `sparql/`, such as `ask("class_knowledge", **{"class": "tray"})`.

        Raises
        ------
        UnknownNameError
            If there is no such question, or an argument names nothing known.
        InputError
            If an argument is missing, not declared, or not of its type.
        """
        return self.answer(stored_query(name), arguments)

    def answer(self, query: Query, arguments: Mapping[str, Argument]) -> Answer:
        """Answer a question with its parameters."""
        return self.query(query.bind(self.resolve, arguments))

    def query(self, text: str) -> Answer:
        """Answer any SPARQL 1.1 query (SELECT, ASK, CONSTRUCT or DESCRIBE).

        Raises
        ------
        InputError
            If it is not valid SPARQL, an update, or asks another server.
        """
        refuse_foreign_access(text)
        try:
            return answer_of(self._store.query(text))
        except SyntaxError as error:
            raise InputError(f"not a valid SPARQL query: {' '.join(str(error).split())}") from None
        except RuntimeError as error:
            raise InputError(f"the query cannot be evaluated: {' '.join(str(error).split())}") from None

    def construct(self, text: str) -> ox.QueryTriples:
        """Return the triples of a CONSTRUCT query of our own."""
        results = self._store.query(text)
        assert isinstance(results, ox.QueryTriples)
        return results

    def stream(self, text: str) -> Iterator[tuple[str | None, ...]]:
        """Yield the rows of a SELECT query of our own as they are found, each term as its text."""
        results = self._store.query(text)
        assert isinstance(results, ox.QuerySolutions)
        try:
            for row in results:
                yield tuple(None if term is None else term.value for term in row)
        except (OSError, RuntimeError) as error:
            raise KnowledgeBaseError(f"cannot read {self.location!r}: {one_line(error)}") from None

    def triples(self) -> Iterable[ox.Triple]:
        """Yield all triples."""
        rows: Any = self._store.query("SELECT ?s ?p ?o WHERE { ?s ?p ?o }")  # whose completeness is checked
        return (ox.Triple(row[0], row[1], row[2]) for row in rows)

    def view(self, load: Callable[["KnowledgeBase"], T]) -> T:
        """Return what `load` makes of this knowledge base; made once, and again after a change."""
        if load not in self._views:
            made = None
            if isinstance(load, View) and load in self._outdated:
                before, changed = self._outdated.pop(load)
                made = load.refresh(before, self, frozenset(changed))
            self._views[load] = load(self) if made is None else made
        found: T = self._views[load]
        return found

    def resolve(self, name: str, kind: str = "iri") -> str:
        """Return the IRI a name stands for.

        Parameters
        ----------
        name : str
            An IRI, a name with prefix (`kb:Tray`), or what people say: "tray", "coffee mug", "size_2".
        kind : {"class", "instance", "property", "quality", "iri"}
            What it must be; "iri" takes anything.

        Raises
        ------
        UnknownNameError
            If nothing of that kind has the name.
        InputError
            If a class and something else share it.
        """
        return lookup.resolve(self, name, kind)

    def kind_of(self, iri: str) -> str:
        """Return "class", "property", "quality" or "instance" for the IRI of something known."""
        return lookup.kind_of(self, iri)

    def known_names(self, kind: str) -> list[str]:
        """Return the names of all classes, instances, properties or qualities, or of everything."""
        return lookup.known_names(self, kind)

    def tell(self, remove: Iterable[str], add: Iterable[str]) -> None:
        """Replace triples, given as lines of N-Triples, and the revision with them, at once.

        Raises
        ------
        LockedError
            If another process is writing, or has written since this one read.
        """
        old, new = set(remove), set(add)
        gone, come = sorted(old - new), sorted(new - old)
        if not gone and not come:
            return
        before = revision_line(int(self.revision, 16))
        revision = (int(self.revision, 16) + revision_of(come) - revision_of(gone)) % (1 << 256)
        after = revision_line(revision)
        if after != before:
            gone, come = [*gone, before], [*come, after]
        self._store.change(gone, come, before)
        self.revision = f"{revision:064x}"
        self._outdated |= {
            load: (made, set()) for load, made in self._views.items() if isinstance(load, View)
        }
        for _, changed in self._outdated.values():
            changed.update(subjects([*gone, *come]))
        self._views.clear()

    def observe(
        self,
        object_class: str,
        instance: str,
        measurements: Mapping[str, float | Sequence[float]],
        *,
        observation: str = "",
        origin: Origin = Origin.MACHINE,
        source: Source | None = None,
    ) -> None:
        """Take in what was measured of an instance, new or known, without a refit.

        Parameters
        ----------
        object_class, instance : str
        measurements : mapping of property name to a number or a vector, in the property's unit
        observation : str
            Name of the observation; needed where the instance is measured more than once.

        Raises
        ------
        InputError
            If a value is missing, repeated, not finite or of the wrong length; if the instance is of
            another class; if the knowledge base holds classes only.
        """
        from ersatz.knowledge.updates import observe

        observe(self, object_class, instance, measurements, observation, origin, source)

    def forget(self, instance: str) -> None:
        """Take an instance out again, with all that was counted of it."""
        from ersatz.knowledge.updates import forget

        forget(self, instance)

    def substitution_model(self, missing: str, settings: str | None = None) -> SubstitutionModel | None:
        """Return the remembered, up-to-date answer for a tool, or None.

        Parameters
        ----------
        missing : str
            The tool's class.
        settings : str, optional
            The reasoner's settings as JSON; needed only where answers under several are remembered.

        Raises
        ------
        InputError
            If several answers are remembered and it is not said which.
        """
        from ersatz.knowledge.substitutions import load_substitution, remembered

        tool = self.resolve(missing, "class")
        known = [iri for iri, of in self.view(remembered).items() if of == tool]
        models = [load_substitution(self, iri) for iri in known]
        fitting = [model for model in models if settings in (None, model.settings)]
        if len(fitting) > 1:
            raise InputError(
                f"{len(fitting)} answers are remembered for {missing!r}: say under which settings"
            )
        return fitting[0] if fitting else None

    def save(self, path: str | Path | None = None) -> None:
        """Write to a file or a new directory; without a path, back to the file it was opened from.

        Raises
        ------
        InputError
            If the name says no format, or the shipped knowledge base would be overwritten.
        LockedError
            If the file was changed by another writer since it was opened.
        """
        if path is None and not isinstance(self._store, MemoryStore):
            return  # a directory or an endpoint changed when it was told
        if path is None and not Path(self.location).exists():
            raise InputError(f"{self.location} has no file to go back to: say where to save it")
        target = Path(path if path is not None else self.location)
        if isinstance(self._store, DirectoryStore) and target.resolve() == self._store.path.resolve():
            return
        if target.resolve() in {(ONTOLOGY / f"{name}.ttl").resolve() for name in SHIPPED}:
            raise InputError(
                f"{target.stem!r} is shipped with ERSATZ: save it elsewhere, such as ./{target.name}"
            )
        if isinstance(self._store, MemoryStore) and target.resolve() == Path(self.location).resolve():
            self._store.save(lambda: write(self.triples(), target))
        else:
            write(self.triples(), target)

    @property
    def graph(self) -> "rdflib.Graph":
        """A read-only rdflib graph of all triples; made once, and again after a change."""
        return self.view(_graph)

    def owl(self) -> Any:
        """Return an owlready2 ontology with the classes and individuals as Python objects; a copy."""
        from ersatz.knowledge.views import owlready2_ontology

        return owlready2_ontology(self.triples())


def _graph(kb: KnowledgeBase) -> "rdflib.Graph":
    from ersatz.knowledge.views import rdflib_graph

    return rdflib_graph(kb.triples())
