"""Query: one file of `sparql/`, its parameters checked before it runs.

A file begins with lines `#+ summary: ...`, `#+ description: ...` and `#+ example: name=value ...`.
A variable `?_<name>_<type>` is a parameter; it is replaced by the text of a checked term, since binding
by an engine is silently wrong where a name is misspelt.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Final, TypeAlias

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge.terms import decimal, finite, integer, iri, text
from ersatz.measurements import DIGITS, LARGEST
from ersatz.resources import SPARQL

Argument: TypeAlias = str | int | float | Decimal | Fraction | Sequence[str]
Resolver: TypeAlias = Callable[[str, str], str]
"""(name, type of the parameter) -> IRI; raises where the knowledge base does not know the name."""

NAMED_TYPES: Final = ("class", "instance", "property", "quality", "iri")
_PARAMETER: Final = re.compile(
    r"[?$]_([a-z]+(?:_[a-z]+)*?)_(class|instance|property|quality|iris|iri|decimal|integer|string)\b"
)
_UNTYPED: Final = re.compile(r"[?$]_\w+")
_HEADER: Final = re.compile(r"^#\+ ?(\w+):\s*(.*)$")
_GAP: Final = r"(?:\s|\#[^\n\r]*)*"
_SERVICE: Final = re.compile(
    rf"(?P<name>[?$]\w*|:[\w-]*|@[A-Za-z0-9-]*)?SERVICE(?={_GAP}(?:SILENT)?{_GAP}(?:<|\w?[\w.-]*:|[?$]))",
    re.IGNORECASE,
)
"""The word before what could be a server, and the name it may be the end of.

The text is searched, not tokenised: a scanner that skips strings, IRIs and comments can be led to skip a
keyword the engine sees (`<` is an operator and opens an IRI), and engines need no space around keywords.
"""
_ESCAPE: Final = re.compile(r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})")


@dataclass(frozen=True, slots=True)
class Query:
    """A question to a knowledge base.

    Attributes
    ----------
    name : str
        The file's stem.
    text : str
        SPARQL 1.1 with parameters.
    summary, description, example, mend : str
        From the header; `mend` only where the question finds faults.
    parameters : mapping of name to type
    """

    name: str
    text: str
    summary: str
    description: str
    example: str
    mend: str
    parameters: Mapping[str, str]

    @classmethod
    def parse(cls, name: str, source: str) -> "Query":
        """Read a query and its header.

        Raises
        ------
        InputError
            If a parameter has no type, or two.
        """
        header: dict[str, str] = {}
        key = ""
        for line in source.splitlines():
            if found := _HEADER.match(line):
                key, words = found.groups()
                header[key] = words
            elif line.startswith("#+") and key:
                header[key] = f"{header[key]} {line[2:].strip()}"
        parameters = _parameters(name, source)
        return cls(
            name,
            source,
            header.get("summary", ""),
            header.get("description", ""),
            header.get("example", ""),
            header.get("mend", ""),
            parameters,
        )

    def bind(self, resolve: Resolver, arguments: Mapping[str, Argument]) -> str:
        """Return the query with every parameter replaced.

        Raises
        ------
        InputError
            If a parameter is missing or not declared, or a value is not of its type.
        UnknownNameError
            If the knowledge base does not know what a name stands for.
        """
        wanted = ", ".join(f"{name} ({kind})" for name, kind in self.parameters.items()) or "none"
        for name in arguments:
            if name not in self.parameters:
                raise InputError(f"query {self.name!r} has no parameter {name!r}; it takes: {wanted}")
        missing = [name for name in self.parameters if name not in arguments]
        if missing:
            raise InputError(f"query {self.name!r} needs {', '.join(missing)}; it takes: {wanted}")
        terms = {name: _term(name, kind, arguments[name], resolve) for name, kind in self.parameters.items()}
        return _PARAMETER.sub(lambda found: terms[found[1]], self.text)


@cache
def stored_query(name: str) -> Query:
    """Return a question of `sparql/` by its name, such as "classes" or "checks/missing_label".

    Raises
    ------
    UnknownNameError
        If there is none; the nearest names are offered.
    """
    path = SPARQL / f"{name}.rq"
    if not re.fullmatch(r"\w+(/\w+)*", name) or not path.is_file():
        raise UnknownNameError("query", name, query_names())
    return Query.parse(name, path.read_text(encoding="utf-8"))


def query_names(folder: str = "") -> tuple[str, ...]:
    """Return the names of all stored questions, or of those in a folder such as "checks"."""
    found = (path.relative_to(SPARQL).with_suffix("") for path in (SPARQL / folder).rglob("*.rq"))
    return tuple(sorted(path.as_posix() for path in found))


def read_query(path: Path) -> Query:
    """Read a question from a user's own file."""
    try:
        return Query.parse(path.stem, path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the query {str(path)!r}: {error}") from None


def refuse_foreign_access(source: str) -> None:
    """Raise if a query asks other servers; it could carry knowledge away or hang.

    Raises
    ------
    InputError
        If it does, or has the word before what looks like a server, in a string too.
    """
    if any(found["name"] is None for found in _SERVICE.finditer(unescaped(source))):
        raise InputError(
            "SERVICE is not allowed: a query may only read this knowledge base (in a string, do not let "
            "'<', '?' or a prefix follow the word)"
        )


def unescaped(source: str) -> str:
    """Return a query as engines read it: they decode \\uXXXX before anything else."""
    return _ESCAPE.sub(lambda found: chr(min(int(found[1] or found[2], 16), 0x10FFFF)), source)


def exact(value: str | float | Decimal | Fraction, name: str = "value") -> Fraction:
    """Return a number exactly as it is written; a float is taken by its repr.

    >>> exact(0.35), exact("1/3")
    (Fraction(7, 20), Fraction(1, 3))
    """
    try:
        if isinstance(value, Fraction):
            return value
        if isinstance(value, bool):
            raise TypeError
        return Fraction(repr(float(value)) if isinstance(value, float) else value)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f"{name} {value!r} is not a number: write it like 0.35") from None


def _parameters(name: str, source: str) -> dict[str, str]:
    """Return the type of each parameter."""
    types: dict[str, str] = {}
    for parameter, kind in _PARAMETER.findall(source):
        if types.setdefault(parameter, kind) != kind:
            raise InputError(f"query {name!r}: parameter {parameter!r} is both {types[parameter]} and {kind}")
    if stray := _UNTYPED.search(_PARAMETER.sub("", source)):
        raise InputError(
            f"query {name!r}: parameter {stray[0]!r} has no type: call it ?_<name>_<type>, "
            f"of type {', '.join((*NAMED_TYPES, 'iris', 'decimal', 'integer', 'string'))}"
        )
    return types


def _term(name: str, kind: str, value: Argument, resolve: Resolver) -> str:
    if kind == "iris":
        names: Iterable[str] = [value] if isinstance(value, str) else _strings(name, value)
        return " ".join(iri(resolve(one, "iri")) for one in names)
    if kind in NAMED_TYPES:
        if not isinstance(value, str):
            raise InputError(f"parameter {name!r} takes a name, not {value!r}")
        return iri(resolve(value, kind))
    if kind == "string":
        if not isinstance(value, str):
            raise InputError(f"parameter {name!r} takes a text, not {value!r}")
        return text(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        raise InputError(f"parameter {name!r} takes one number, not {value!r}")
    number = exact(value, f"parameter {name!r}:")
    if kind == "integer" and number.denominator != 1:
        raise InputError(f"parameter {name!r} takes a whole number, not {value!r}")
    try:
        written = finite(number)
    except InputError as error:
        raise InputError(f"parameter {name!r}: {error}") from None
    # Engines compute in so many digits, and drop a row without a word where a product overflows.
    if abs(number) >= LARGEST or (number * 10**DIGITS).denominator != 1:
        raise InputError(
            f"parameter {name!r} takes a number below {LARGEST:g} with at most {DIGITS} digits after the "
            f"point, not {value!r}: round it"
        )
    return integer(number.numerator) if kind == "integer" else decimal(written)


def _strings(name: str, value: object) -> list[str]:
    if isinstance(value, Sequence) and all(isinstance(one, str) for one in value):
        return list(value)
    raise InputError(f"parameter {name!r} takes names, not {value!r}")
