"""Terms as RDF writes them: canonical, so that equal values are equal text in every store."""

from collections.abc import Iterable, Iterator
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache

from pyoxigraph import Literal, NamedNode, Quad, Triple

from ersatz.errors import InputError
from ersatz.grounding.fuzzy import DEGREE
from ersatz.knowledge.vocabulary import LABEL, NAMED_INDIVIDUAL, TYPE, XSD

_DECIMAL = f"^^<{XSD}decimal>"
_INTEGER = f"^^<{XSD}integer>"
_TYPE, _INDIVIDUAL, _LABEL = str(TYPE), str(NAMED_INDIVIDUAL), str(LABEL)
PROPORTION_DIGITS = 6


def plain(value: Decimal | float) -> str:
    """Return the shortest decimal notation without exponent.

    >>> plain(1e-07), plain(3.0), plain(Decimal("0.350"))
    ('0.0000001', '3', '0.35')
    """
    text = format(value if isinstance(value, Decimal) else Decimal(repr(float(value))), "f")
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def decimal(value: Decimal | float) -> str:
    """Return an xsd:decimal literal in N-Triples."""
    return f'"{plain(value)}"{_DECIMAL}'


def finite(value: Fraction) -> Decimal:
    """Return a fraction as the decimal number it is.

    Raises
    ------
    InputError
        If it has no finite decimal notation, such as 1/3.
    """
    with localcontext(prec=60):
        written = Decimal(value.numerator) / Decimal(value.denominator)
        if Fraction(written) != value:
            raise InputError(f"{value} has no finite decimal notation: give a number such as 0.35")
        return written


def degree(count: int) -> str:
    """Return a count kept in millionths as an xsd:decimal literal in N-Triples.

    >>> degree(2_500_000)
    '"2.5"^^<http://www.w3.org/2001/XMLSchema#decimal>'
    """
    return f'"{degree_text(count)}"{_DECIMAL}'


@lru_cache(maxsize=1 << 12)
def degree_text(count: int) -> str:
    """Return a count kept in millionths as a plain decimal number."""
    whole, part = divmod(count, DEGREE)
    return f"{whole}.{part:06d}".rstrip("0") if part else str(whole)


def rough_text(count: int) -> str:
    """Return a count kept in millionths as a person reads it: to a hundredth.

    >>> rough_text(3_601_978), rough_text(7_000_000)
    ('3.6', '7')
    """
    return degree_text(round(count, -4))


def millionths(count: Decimal) -> int:
    """Return a count as whole millionths.

    >>> millionths(Decimal("2.5"))
    2500000
    """
    return int(count.scaleb(PROPORTION_DIGITS))


@lru_cache(maxsize=1 << 12)
def proportion_text(count: int, total: int) -> str:
    """Return count / total rounded half to even to six places, as a plain decimal number.

    >>> proportion_text(2, 3), proportion_text(1, 1)
    ('0.666667', '1')
    """
    quotient, rest = divmod(count * DEGREE, total)
    up = 2 * rest > total or (2 * rest == total and quotient % 2 == 1)
    return degree_text(quotient + up)


def integer(value: int) -> str:
    """Return an xsd:integer literal in N-Triples."""
    return f'"{value}"{_INTEGER}'


def text(value: str) -> str:
    """Return a plain string literal in N-Triples."""
    return str(Literal(value))


def english(value: str) -> str:
    """Return a string literal in English in N-Triples."""
    return str(Literal(value, language="en"))


def iri(value: str) -> str:
    """Return an IRI in N-Triples; one that is not valid raises ValueError."""
    return str(NamedNode(value))


def lines_of(triples: Iterable[Triple | Quad]) -> Iterator[str]:
    """Yield triples as lines of N-Triples; of quads, what they say in their graph."""
    for triple in triples:
        yield f"{triple.subject} {triple.predicate} {triple.object} .\n"


def statements(subject: object, *pairs: tuple[object, object]) -> Iterator[str]:
    """Yield one triple for each pair of a predicate and its value."""
    for predicate, value in pairs:
        yield f"{subject} {predicate} {value} .\n"


def individual(subject: object, type_: object, label: str) -> Iterator[str]:
    """Yield what is said of every named thing: that it is an individual, its type, its English label."""
    yield f"{subject} {_TYPE} {_INDIVIDUAL} .\n"
    yield f"{subject} {_TYPE} {type_} .\n"
    yield f"{subject} {_LABEL} {english(label)} .\n"
