"""Warming: what the first visitor of a page would wait for."""

import gc

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.substitution import rank_substitutes
from ersatz.service.pages.data import overview, shipped_mappings
from ersatz.service.pages.tree import Tree


def warm(kb: KnowledgeBase) -> None:
    """Read what most pages need: the classes, their tree, the reasoner's index and the mappings."""
    kb.view(Tree).lines(set())
    shipped_mappings()
    for iri, _, _ in overview(kb).classes[:1]:
        try:
            rank_substitutes(kb, iri, top=1)
        except ErsatzError:
            break  # the pages will say why
    # What stays for good is not looked through by every collection of garbage: a visitor would wait for it.
    gc.collect()
    gc.freeze()
