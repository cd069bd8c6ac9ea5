"""Warming: what the first visitor of a page would wait for."""

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.substitution import rank_substitutes
from ersatz.service.pages.data import overview, shipped_mappings
from ersatz.service.pages.tree import Tree


def warm(kb: KnowledgeBase) -> None:
    """Read what most pages need: the classes, their tree, the reasoner's index and the mappings."""
    kb.view(Tree)
    shipped_mappings()
    for iri, _, _ in overview(kb).classes[:1]:
        try:
            rank_substitutes(kb, iri, top=1)
        except ErsatzError:
            return  # the pages will say why
