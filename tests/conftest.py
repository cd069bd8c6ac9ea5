"""Fixtures every test can use."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli import Shell

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(os.environ.get("ERSATZ_DATA", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of other people's data; tests that need it skip where it is absent."""
    if not DATA.is_dir():
        pytest.skip(f"no shared data at {DATA}: set ERSATZ_DATA to run this test")
    return DATA


@pytest.fixture
def ersatz(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Shell:
    """The command line: `ersatz("show", "household").out`."""
    return Shell(capsys, monkeypatch)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """A small property table: three classes, nine objects, two physical and one functional property."""
    path = tmp_path / "objects.csv"
    path.write_text(TABLE, encoding="utf-8")
    return path


@pytest.fixture
def small_kb(table: Path) -> Iterator[Path]:
    """A knowledge base grounded in that table, as a Turtle file."""
    from ersatz.grounding.subcategorization import SubcategorizationSettings
    from ersatz.pipeline import Settings, build

    out = table.with_name("small.ttl")
    build(tables=[table], settings=Settings(SubcategorizationSettings(2, restarts=5)), out=out)
    yield out


TABLE = """\
object_class,instance,weight [kg],rigidity,support [m2]
plate,plate_1,0.3,0.9,0.03
plate,plate_2,0.4,0.95,0.04
plate,plate_3,0.35,0.9,0.035
tray,tray_1,0.9,0.92,0.1
tray,tray_2,1.0,0.9,0.12
tray,tray_3,0.4,0.97,0.11
sponge,sponge_1,0.02,0.1,0.005
sponge,sponge_2,0.03,0.15,0.006
sponge,sponge_3,0.01,0.05,0.004
"""
