"""Indices: the models of a knowledge base packed for some settings, kept until knowledge changes."""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Final

from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.quantised import GradedIndex, build_graded
from ersatz.reasoner.relevance import Index, ReasonerSettings, build_index
from ersatz.reasoner.representative import load_knowledge

MOST: Final = 32
"""Settings whose index is kept. Whoever serves strangers must not grow with every threshold they try."""


def crisp_index(kb: KnowledgeBase, settings: ReasonerSettings) -> Index:
    """Return the representative models at crisp settings."""
    return kb.view(_crisp)(settings)


def graded_index(kb: KnowledgeBase, settings: ReasonerSettings) -> GradedIndex:
    """Return the degrees at graded settings."""
    return kb.view(_graded)(settings)


def _crisp(kb: KnowledgeBase) -> Callable[[ReasonerSettings], Index]:
    return lru_cache(MOST)(partial(build_index, kb.view(load_knowledge)))


def _graded(kb: KnowledgeBase) -> Callable[[ReasonerSettings], GradedIndex]:
    return lru_cache(MOST)(partial(build_graded, kb.view(load_knowledge)))
