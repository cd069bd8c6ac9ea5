"""Where the ontology and the questions lie: inside the wheel, or beside the package in a clone."""

from pathlib import Path
from typing import Final

_PACKAGE: Final = Path(__file__).resolve().parent
_ROOT: Final = _PACKAGE if (_PACKAGE / "sparql").is_dir() else _PACKAGE.parent

ONTOLOGY: Final = _ROOT / "ontology"
SPARQL: Final = _ROOT / "sparql"
DATA: Final = _PACKAGE / "data"
