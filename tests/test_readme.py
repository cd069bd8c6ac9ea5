"""The README is true: its commands print what it says they print, and its Python runs."""

import doctest
import re
import shlex

import pytest

import ersatz as package
from tests.cli import Shell
from tests.conftest import ROOT

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
CONSOLE = re.findall(r"```console\n(.*?)```", TEXT, re.DOTALL)
PYTHON = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
COMMANDS = [
    (command.strip(), output)
    for block in CONSOLE
    for command, output in re.findall(r"^\$ (ersatz .*)\n((?:(?!\$ ).*\n)*)", block, re.MULTILINE)
]


def test_there_is_something_to_check() -> None:
    assert len(COMMANDS) >= 3
    assert PYTHON
    assert "<!-- main job -->" in TEXT
    assert "<!-- tests -->" in TEXT


@pytest.mark.parametrize(("command", "output"), COMMANDS, ids=[command for command, _ in COMMANDS])
def test_console(
    command: str,
    output: str,
    ersatz: Shell,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """Commands run in one folder, in the order of the README; an output of "…" lines may be cut."""
    monkeypatch.chdir(tmp_path_factory.getbasetemp())
    run = ersatz(*shlex.split(command)[1:])
    assert run.code == 0, run.err
    said = [line.rstrip() for line in (run.out + run.err).splitlines()]
    wanted = [line.rstrip() for line in output.splitlines() if line.strip()]
    if wanted and wanted[-1] == "…":
        wanted.pop()
        said = said[: len(wanted)]
    assert [line for line in said if line] == wanted


@pytest.mark.parametrize("block", PYTHON, ids=lambda block: block.splitlines()[0])
def test_python(
    block: str, monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    monkeypatch.chdir(tmp_path_factory.getbasetemp())
    test = doctest.DocTestParser().get_doctest(block, {"ersatz": package}, "README", "README.md", 0)
    assert test.examples
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    runner.run(test)
    assert runner.failures == 0
