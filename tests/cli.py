"""Run the command line in this process, as a shell would see it."""

import sys
from dataclasses import dataclass

import pytest

from ersatz.cli.main import main


@dataclass(frozen=True, slots=True)
class Run:
    """What a command left behind."""

    code: int
    out: str
    err: str


class Shell:
    """Calls `ersatz` and collects what it prints."""

    def __init__(self, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
        self._capsys = capsys
        self._monkeypatch = monkeypatch
        monkeypatch.setenv("COLUMNS", "100")
        monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)

    def __call__(self, *arguments: object) -> Run:
        """Run one command."""
        self._monkeypatch.setattr(sys, "argv", ["ersatz", *map(str, arguments)])
        self._capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        out, err = self._capsys.readouterr()
        return Run(int(end.value.code or 0), out, err)
