"""Rivals that know words: WordNet 3.0 as Debian's `wordnet-base` installs it, read where it lies."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ersatz.errors import MissingDependencyError, UnknownNameError
from ersatz.evaluation.agreement import Answer
from ersatz.evaluation.methods import Context
from ersatz.evaluation.scenarios import Scenario

FOLDER: Final = Path("/usr/share/wordnet")

SENSES: Final = {
    "ball": ("ball", 2779435),  # spherical object used as a plaything
    "binder": ("binder", 2840245),  # holds loose papers
    "bowl": ("bowl", 2881193),  # round vessel, open at the top
    "cap": ("cap", 2954340),  # headdress
    "cereal box": ("cereal box", 2998003),
    "coffee mug": ("coffee mug", 3063599),
    "flashlight": ("flashlight", 3359137),
    "food bag": ("bag", 2773037),  # flexible container with a single opening
    "food box": ("carton", 2971356),
    "food can": ("can", 2946921),  # airtight sealed metal container for food
    "food cup": ("cup", 3147509),  # small open container
    "food jar": ("jar", 3593526),  # vessel with a wide mouth
    "hand towel": ("hand towel", 3490006),
    "keyboard": ("computer keyboard", 3085013),
    "kleenex": ("kleenex", 14928008),
    "notebook": ("notebook", 6415419),  # book, not computer
    "pitcher": ("pitcher", 3950228),  # vessel, not player
    "plate": ("plate", 3959936),  # dish on which food is served
    "shampoo": ("shampoo", 4183516),
    "soda can": ("soda can", 4255586),
    "sponge": ("sponge", 14597758),  # porous mass
    "tray": ("tray", 4476259),
    "water bottle": ("water bottle", 4557648),
}
"""Which sense a category is: a lemma and the place of its synset in data.noun of WordNet 3.0."""


@dataclass(frozen=True, slots=True)
class WordNet:
    """The noun hierarchy, read a synset at a time.

    Attributes
    ----------
    folder : Path
        Holds data.noun and index.noun.
    """

    folder: Path = FOLDER
    _paths: dict[int, dict[int, int]] = field(default_factory=dict)

    def synset(self, name: str) -> int:
        """Return the place of the synset of a category; else of the first sense of the word.

        Raises
        ------
        UnknownNameError
            If WordNet has no such noun, or another edition is installed.
        """
        if name in SENSES:
            lemma, place = SENSES[name]
            if lemma.replace(" ", "_") in self._words(place):
                return place
        with (self.folder / "index.noun").open(encoding="latin-1") as index:
            for line in index:
                if line.startswith(name.replace(" ", "_").lower() + " "):
                    return int(line.split()[-int(line.split()[2])])
        raise UnknownNameError("noun", name, SENSES, "in WordNet")

    def ancestors(self, place: int) -> dict[int, int]:
        """Return every synset above, and itself, with the least number of steps up to it."""
        if place not in self._paths:
            steps, level, edge = {place: 0}, 0, [place]
            while edge:
                level += 1
                edge = [up for at in edge for up in self._above(at) if up not in steps]
                steps |= dict.fromkeys(edge, level)
            self._paths[place] = steps
        return self._paths[place]

    def depth(self, place: int) -> int:
        """Return the steps up to the root."""
        return max(self.ancestors(place).values())

    def _line(self, place: int) -> list[str]:
        with (self.folder / "data.noun").open("rb") as data:
            data.seek(place)
            return data.readline().decode("latin-1").split()

    def _words(self, place: int) -> set[str]:
        fields = self._line(place)
        if len(fields) < 4 or fields[0] != f"{place:08d}":
            return set()
        return {word.lower() for word in fields[4 : 4 + 2 * int(fields[3], 16) : 2]}

    def _above(self, place: int) -> list[int]:
        fields = self._line(place)
        start = 4 + 2 * int(fields[3], 16)
        pointers = (fields[at : at + 3] for at in range(start + 1, start + 1 + 4 * int(fields[start]), 4))
        return [int(target) for symbol, target, pos in pointers if symbol in ("@", "@i") and pos == "n"]


@dataclass(frozen=True, slots=True)
class WuPalmer:
    """The word nearest in meaning: depth of the nearest common ancestor over the mean depth (Wu & "
    "Palmer 1994)."""

    wordnet: WordNet

    def answer(self, scenario: Scenario) -> Answer:
        """Score by Wu and Palmer's similarity."""
        missing = self.wordnet.synset(scenario.missing)
        places = map(self.wordnet.synset, scenario.available)
        return Answer(tuple(self.similarity(missing, place) for place in places))

    def similarity(self, a: int, b: int) -> float:
        """Return 2 d(c) / (up(a) + up(b) + 2 d(c)) of the best common ancestor c, d counted from 1."""
        above, also = self.wordnet.ancestors(a), self.wordnet.ancestors(b)
        best = 0.0
        for common in above.keys() & also.keys():
            depth = 2 * (self.wordnet.depth(common) + 1)
            best = max(best, depth / (above[common] + also[common] + depth))
        return round(best, 9)


@dataclass(frozen=True, slots=True)
class Inheritance:
    """A thing of the same kind, after Awaad, Kraetzschmar & Hertzberg 2014.

    Takes from "Challenges in finding ways to get the job done": that what serves the same function is
    found by going up to the tool's parent, which bequeaths its function, and down to its other children;
    an equivalent comes first. Does not take: their ontology of functional affordances (WordNet's hierarchy
    stands for it), nor the conceptual spaces that choose among siblings.
    """

    wordnet: WordNet

    def answer(self, scenario: Scenario) -> Answer:
        """Score by the fewest steps up from the tool to an ancestor of the object; one or none accepts."""
        above = self.wordnet.ancestors(self.wordnet.synset(scenario.missing))
        steps = []
        for name in scenario.available:
            also = self.wordnet.ancestors(self.wordnet.synset(name))
            steps.append(min(above[common] for common in above.keys() & also.keys()))
        accepted = frozenset(n for n, up in zip(scenario.available, steps, strict=True) if up <= 1)
        return Answer(tuple(-float(up) for up in steps), accepted)


def wu_palmer(context: Context) -> WuPalmer:
    """Return the method, all words of the scenarios looked up."""
    return WuPalmer(_checked(context, "wordnet"))


def inheritance(context: Context) -> Inheritance:
    """Return the method, all words of the scenarios looked up."""
    return Inheritance(_checked(context, "inheritance"))


def _checked(context: Context, name: str) -> WordNet:
    wordnet = WordNet(context.sources.get(name, FOLDER))
    if not (wordnet.folder / "data.noun").is_file():
        raise MissingDependencyError(
            f"no WordNet at {str(wordnet.folder)!r}: install Debian's wordnet-base, or give the folder of "
            f"data.noun"
        )
    for word in {name for s in context.scenarios for name in (s.missing, *s.available)}:
        wordnet.synset(word)
    return wordnet
