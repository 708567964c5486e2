"""The command line in the process of a test."""

from __future__ import annotations

import pytest

from steptwin.cli import main


class Shell:
    """Runs the command line in this process. What it printed, what it complained about, and its exit code."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch = monkeypatch
        self._capsys = capsys
        self.errors = ""
        self.code = 0

    def __call__(self, *arguments: str) -> str:
        self._monkeypatch.setattr("sys.argv", ["steptwin", *arguments])
        self._capsys.readouterr()
        self.code = 0
        try:
            main()
        except SystemExit as end:
            self.code = end.code if isinstance(end.code, int) else 0
        out, self.errors = self._capsys.readouterr()
        return out
