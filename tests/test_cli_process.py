"""The command line as a process: what it leaves behind is whole, though it ends at once."""

import subprocess
import sys
from pathlib import Path

import pytest


def ended(*arguments: str, out: Path) -> tuple[int, str]:
    """Run one command with its output in a file; return its code and its errors."""
    command = [sys.executable, "-c", "from ersatz.cli.main import run; run()", *arguments]
    with out.open("w", encoding="utf-8") as file:
        done = subprocess.run(command, stdout=file, stderr=subprocess.PIPE, text=True, check=False)
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "printed", "told"),
    [
        (("substitute", "household", "--missing", "tray", "--json"), 0, '"missing": "tray"', ""),
        (("substitute", "household", "--missing", "trya"), 2, "", "unknown class 'trya'"),
        (("query", "household", "classes", "--format", "csv"), 0, "Tray", ""),
        (("--version",), 0, ".", ""),
        ((), 0, "Usage", ""),
    ],
    ids=["json", "error", "rows", "version", "help"],
)
def test_a_process_prints_all_and_ends_with_its_code(
    arguments: tuple[str, ...], code: int, printed: str, told: str, tmp_path: Path
) -> None:
    found, errors = ended(*arguments, out=tmp_path / "out")
    assert (found, told in errors) == (code, True), errors
    assert printed in (tmp_path / "out").read_text(encoding="utf-8")


def test_what_a_process_wrote_is_whole(tmp_path: Path) -> None:
    kb = tmp_path / "kb.nt"
    for arguments in (
        ("export", "household", str(kb)),
        ("substitute", str(kb), "--missing", "tray", "--remember"),
        ("check", str(kb)),
    ):
        code, errors = ended(*arguments, out=tmp_path / "out")
        assert code == 0, errors
    assert "nothing found" in (tmp_path / "out").read_text(encoding="utf-8")


def test_what_was_printed_before_an_error_is_not_lost(tmp_path: Path) -> None:
    program = (
        "import atexit, sys\nfrom ersatz.cli.main import run\n"
        "atexit.register(print, 'and at the end')\nprint('before')\nrun()"
    )
    command = [sys.executable, "-c", program, "substitute", "household", "--missing", "trya"]
    with (tmp_path / "out").open("w", encoding="utf-8") as file:
        done = subprocess.run(command, stdout=file, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert (tmp_path / "out").read_text(encoding="utf-8") == "before\nand at the end\n"
