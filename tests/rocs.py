"""RoCS's own symbols and concepts, named as `read_rocs` names instances and classes."""

import json
from pathlib import Path


def published_symbols(folder: Path) -> dict[str, dict[str, int]]:
    """Return instance -> property -> number of the cluster, from object_instance_knowledge.json."""
    path = folder / "conceptual_knowledge" / "object_instance_knowledge.json"
    found: dict[str, list[str]] = json.loads(path.read_text(encoding="utf-8"))
    split = {name: [symbol.rpartition("_") for symbol in symbols] for name, symbols in found.items()}
    return {name: {prop: int(number) for prop, _, number in symbols} for name, symbols in split.items()}


def published_concepts(folder: Path) -> dict[str, dict[str, float]]:
    """Return class label -> symbol, as "size_2" -> degree, from object_concept_knowledge.json."""
    path = folder / "conceptual_knowledge" / "object_concept_knowledge.json"
    found: dict[str, dict[str, float]] = json.loads(path.read_text(encoding="utf-8"))
    return {name.strip("_").replace("_", " "): degrees for name, degrees in found.items()}
