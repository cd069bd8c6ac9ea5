"""Which store the name of a knowledge base stands for.

Needs nothing but stores, so that a file can be parsed while the rest is imported.
"""

from pathlib import Path
from typing import Final

from ersatz.errors import KnowledgeBaseError
from ersatz.knowledge.directory import DirectoryStore, is_directory_store
from ersatz.knowledge.stores import FORMATS, MemoryStore, Store, format_of
from ersatz.resources import ONTOLOGY

SHIPPED: Final = ("household",)
"""Names of knowledge bases that come with ERSATZ."""


def path_of(name: str) -> Path:
    """Return the file or directory a name stands for: a shipped knowledge base, or a path."""
    return ONTOLOGY / f"{name}.ttl" if name in SHIPPED else Path(name)


def open_store(location: str | Path, update: str | None = None) -> Store:
    """Open what `KnowledgeBase.open` names, whatever is in it.

    Raises
    ------
    KnowledgeBaseError
        If there is nothing, or it is damaged.
    """
    name = str(location)
    if name.startswith(("http://", "https://")):
        from ersatz.knowledge.remote import RemoteStore

        return RemoteStore(name, update)
    path = path_of(name)
    if path.is_dir():
        if is_directory_store(path):
            return DirectoryStore(path)
        raise KnowledgeBaseError(
            f"{name!r} is a directory, but no knowledge base: name one made by `ersatz build`"
        )
    if not path.exists() and format_of(path) is None:
        raise KnowledgeBaseError(
            f"there is no knowledge base {name!r}: give {' or '.join(map(repr, SHIPPED))}, a file "
            f"({', '.join(FORMATS)}), a directory or a URL"
        )
    return MemoryStore.read(path)
