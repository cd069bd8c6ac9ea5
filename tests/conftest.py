"""Fixtures every test can use."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(os.environ.get("ERSATZ_DATA", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of other people's data; tests that need it skip where it is absent."""
    if not DATA.is_dir():
        pytest.skip(f"no shared data at {DATA}: set ERSATZ_DATA to run this test")
    return DATA
