"""ERSATZ: a grounded knowledge base of what can stand in for a missing tool, and why.

The public names in the order of the line: scan, shape, measurement, quality, membership, knowledge
base, substitute. Importing the package loads none of them; each is imported when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from ersatz.errors import ErsatzError, ErsatzWarning
    from ersatz.knowledge.base import KnowledgeBase
    from ersatz.knowledge.models import ClassModel, FunctionModel, SubstitutionModel
    from ersatz.measurements import Kind, Measurements, Origin, Property, Source
    from ersatz.pipeline import Settings, build
    from ersatz.reasoner.asking import ask_for_more
    from ersatz.reasoner.batch import Batch, rank_many
    from ersatz.reasoner.relevance import ReasonerSettings
    from ersatz.reasoner.representative import class_model, function_model
    from ersatz.reasoner.substitution import Ranking, Substitute, rank_substitutes

__version__ = "0.1.0"

_HOMES: Final = {
    "ErsatzError": "errors",
    "ErsatzWarning": "errors",
    "Kind": "measurements",
    "Measurements": "measurements",
    "Origin": "measurements",
    "Property": "measurements",
    "Source": "measurements",
    "KnowledgeBase": "knowledge.base",
    "ClassModel": "knowledge.models",
    "FunctionModel": "knowledge.models",
    "SubstitutionModel": "knowledge.models",
    "Batch": "reasoner.batch",
    "rank_many": "reasoner.batch",
    "ReasonerSettings": "reasoner.relevance",
    "class_model": "reasoner.representative",
    "function_model": "reasoner.representative",
    "Ranking": "reasoner.substitution",
    "ask_for_more": "reasoner.asking",
    "Substitute": "reasoner.substitution",
    "rank_substitutes": "reasoner.substitution",
    "Settings": "pipeline",
    "build": "pipeline",
}

__all__ = [
    "Batch",
    "ClassModel",
    "ErsatzError",
    "ErsatzWarning",
    "FunctionModel",
    "Kind",
    "KnowledgeBase",
    "Measurements",
    "Origin",
    "Property",
    "Ranking",
    "ReasonerSettings",
    "Settings",
    "Source",
    "Substitute",
    "SubstitutionModel",
    "ask_for_more",
    "build",
    "class_model",
    "function_model",
    "rank_many",
    "rank_substitutes",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module 'ersatz' has no attribute {name!r}")
    return getattr(import_module(f"ersatz.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
