"""Names: from what people call things to IRIs, by one rule.

A class is CamelCase, everything else snake_case; words are separated by anything that is neither a
letter, a mark on one, nor a digit in any script; letters keep their script, in Unicode's form NFKC
("m²" is "m2"); a name that would begin with a digit or a mark gets a leading underscore. Two labels
with one name are an error where they meet (`distinct`).

>>> class_name("coffee mug"), snake_name("Coffee-Mug 3"), snake_name("7up can"), class_name("café crème")
('CoffeeMug', 'coffee_mug_3', '_7up_can', 'CaféCrème')
"""

import re
import unicodedata
from collections.abc import Callable, Iterable
from functools import lru_cache

from ersatz.errors import InputError
from ersatz.knowledge.vocabulary import KB

_SELECTOR = re.compile("[\U000e0100-\U000e01ef]")
"""Marks that choose a variant of a glyph: the only letters, marks and digits an IRI cannot have."""


@lru_cache(maxsize=1 << 14)
def class_name(label: str) -> str:
    """Return the CamelCase local name of an object class."""
    return _guarded("".join(word[0].upper() + word[1:] for word in _words(label)))


@lru_cache(maxsize=1 << 14)
def snake_name(label: str) -> str:
    """Return the snake_case local name of anything but a class."""
    return _guarded("_".join(word.lower() for word in _words(label)))


def class_iri(label: str) -> str:
    """Return the IRI of an object class, `kb:CoffeeMug`."""
    return KB + class_name(label)


def model_iri(label: str) -> str:
    """Return the IRI of what is known of an object class, `kb:model_CoffeeMug`."""
    return f"{KB}model_{class_name(label)}"


def snake_iri(label: str) -> str:
    """Return the IRI of an instance, a property or a quality, `kb:coffee_mug_3`."""
    return KB + snake_name(label)


def local_name(iri: str) -> str:
    """Return what stands after the namespace."""
    return re.split(r"[#/]", iri)[-1]


def distinct(named: Iterable[tuple[str, str]]) -> None:
    """Check that no IRI names two things.

    Parameters
    ----------
    named : iterable of (IRI, what it names)

    Raises
    ------
    InputError
        If one IRI would stand for two things.
    """
    seen: dict[str, str] = {}
    for iri, thing in named:
        if seen.setdefault(iri, thing) != thing:
            raise InputError(
                f"{seen[iri]} and {thing} would both be called {local_name(iri)!r}: rename one of them"
            )


def refuse_renamed(iri: str, label: str, named: Callable[[str], str]) -> None:
    """Raise if a label is not the one an IRI was made of: what is to be removed could not be found by it."""
    if named(label) != iri:
        raise InputError(
            f"{local_name(iri)!r} has been given the label {label!r}, of which {local_name(named(label))!r} "
            "would be made: give it back its one English rdfs:label, and say other names as skos:altLabel"
        )


def _words(label: str) -> list[str]:
    plain = _SELECTOR.sub("", _normal(label))
    kept = (char if unicodedata.category(char)[0] in "LMN" else " " for char in plain)
    words = [word for word in "".join(kept).split() if any(map(str.isalnum, word))]
    if not words:
        raise InputError(f"{label!r} cannot be a name: it has neither letter nor digit")
    return words


def _guarded(name: str) -> str:
    name = _normal(name)
    return name if unicodedata.category(name[0])[0] == "L" else f"_{name}"


def _normal(text: str) -> str:
    return unicodedata.normalize("NFKC", text)
