"""Answer: the rows an engine gives to a query, as Python values."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import TypeAlias, overload

import pyoxigraph as ox

from ersatz.errors import InputError
from ersatz.knowledge.stores import Results
from ersatz.knowledge.vocabulary import XSD

Value: TypeAlias = str | int | Decimal | bool | None
"""A cell of an answer: IRIs and strings as str, numbers as int or Decimal, unbound as None."""


@dataclass(frozen=True, slots=True)
class Answer(Sequence[Mapping[str, Value]]):
    """The rows of an answer, each a mapping from variable to value.

    Attributes
    ----------
    variables : tuple of str
    rows : tuple of tuples of Value
    triples : tuple of triples
        Of a CONSTRUCT or DESCRIBE query, the same as RDF terms.
    """

    variables: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]
    triples: tuple[ox.Triple, ...] = ()

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.rows)

    def to_turtle(self) -> str:
        """Return the triples of a CONSTRUCT or DESCRIBE query as Turtle.

        Raises
        ------
        InputError
            If the answer is a table.
        """
        from ersatz.knowledge.turtle import turtle

        if not self.triples:
            raise InputError("only the answer of a CONSTRUCT or DESCRIBE query is RDF: choose another format")
        return "".join(turtle(self.triples))

    def __iter__(self) -> Iterator[Mapping[str, Value]]:
        """Yield the rows."""
        return (dict(zip(self.variables, row, strict=True)) for row in self.rows)

    @overload
    def __getitem__(self, at: int) -> Mapping[str, Value]: ...
    @overload
    def __getitem__(self, at: slice) -> Sequence[Mapping[str, Value]]: ...
    def __getitem__(self, at: int | slice) -> Mapping[str, Value] | Sequence[Mapping[str, Value]]:
        """Return one row, or some."""
        if isinstance(at, slice):
            return Answer(self.variables, self.rows[at])
        return dict(zip(self.variables, self.rows[at], strict=True))


def answer_of(results: Results) -> Answer:
    """Return what an engine answers as Python values."""
    if isinstance(results, ox.QueryBoolean):
        return Answer(("answer",), ((bool(results),),))
    if isinstance(results, ox.QueryTriples):
        triples = tuple(results)
        rows = tuple((value_of(t.subject), value_of(t.predicate), value_of(t.object)) for t in triples)
        return Answer(("subject", "predicate", "object"), rows, triples)
    variables = tuple(variable.value for variable in results.variables)
    return Answer(variables, tuple(tuple(value_of(term) for term in solution) for solution in results))


def value_of(term: object) -> Value:
    """Return an RDF term as a Python value."""
    if isinstance(term, ox.Literal):
        try:
            return _literal_value(term.value, term.datatype.value.removeprefix(XSD))
        except (ValueError, ArithmeticError):
            return term.value  # not of the type it claims
    if isinstance(term, ox.NamedNode | ox.BlankNode):
        return term.value
    return None if term is None else str(term)


def _literal_value(text: str, kind: str) -> Value:
    if kind == "decimal":
        return Decimal(text)
    if kind in ("integer", "int", "long", "nonNegativeInteger", "positiveInteger"):
        return int(text)
    if kind in ("double", "float"):
        return Decimal(repr(float(text)))
    return text in ("true", "1") if kind == "boolean" else text
