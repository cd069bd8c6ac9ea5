"""Units that are plain multiples of a property's unit, converted exactly.

A unit is a product of symbols with whole exponents: "kg", "cm2", "kg m2", "g cm^2", "m²", "ml", "%"; "1" is
the dimensionless unit. Symbols not listed here (N, K, ...) stand for themselves and have no multiples.
"""

import re
from fractions import Fraction
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

MULTIPLES: Final[dict[str, tuple[str, int, Fraction]]] = {
    **{
        s: ("kg", 1, Fraction(f))
        for s, f in {"kg": "1", "g": "1/1000", "mg": "1/1000000", "t": "1000"}.items()
    },
    **{
        s: ("m", 1, Fraction(f))
        for s, f in {
            "m": "1",
            "dm": "1/10",
            "cm": "1/100",
            "mm": "1/1000",
            "um": "1/1000000",
            "km": "1000",
        }.items()
    },
    **{
        s: ("m", 3, Fraction(f, 1000))
        for s, f in {
            "l": Fraction(1),
            "dl": Fraction("1/10"),
            "cl": Fraction("1/100"),
            "ml": Fraction("1/1000"),
        }.items()
    },
    "%": ("", 0, Fraction(1, 100)),
    "1": ("", 0, Fraction(1)),
}
"""Symbol -> (base symbol, exponent, how many of the base it is); a litre is a thousandth of a cubic metre."""

_SPELLINGS: Final = str.maketrans(
    {"²": "2", "³": "3", "^": "", "*": " ", "·": " ", "µ": "u", "μ": "u", "L": "l"}
)
_FACTOR: Final = re.compile(r"([^\W\d_]+|%)([1-9]?)\Z|(1)\Z")


@cache
def factor(unit: str, target: str) -> Fraction | None:
    """Return how many of `target` one `unit` is, or None if it is no multiple of it.

    >>> factor("g", "kg"), factor("cm2", "m2"), factor("ml", "l"), factor("lb", "kg")
    (Fraction(1, 1000), Fraction(1, 10000), Fraction(1, 1000), None)
    """
    one, two = _parse(unit), _parse(target)
    if one is None or two is None:
        return Fraction(1) if unit == target else None
    return one[1] / two[1] if one[0] == two[0] else None


def scale(values: NDArray[np.float64], by: Fraction) -> NDArray[np.float64]:
    """Return values times a fraction, with one rounding: 12.3 g is 0.0123 kg to the last digit stored.

    Multiplying by the float 0.001 would round twice.
    """
    scaled: NDArray[np.float64] = values * float(by.numerator) / float(by.denominator)
    return scaled


def _parse(unit: str) -> tuple[tuple[tuple[str, int], ...], Fraction] | None:
    """Return the exponents of the base symbols and the multiple, or None if it does not read as a product."""
    exponents: dict[str, int] = {}
    multiple = Fraction(1)
    for part in unit.translate(_SPELLINGS).split():
        match = _FACTOR.match(part)
        if match is None:
            return None
        symbol, power = match[1] or "1", int(match[2] or 1)
        base, exponent, times = MULTIPLES.get(symbol, (symbol, 1, Fraction(1)))
        exponents[base] = exponents.get(base, 0) + exponent * power
        multiple *= times**power
    if not unit.strip():
        return None
    return tuple(sorted((base, n) for base, n in exponents.items() if n)), multiple
