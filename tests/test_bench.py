"""``python -m bench`` knows what it can measure."""

from __future__ import annotations

import sys

import pytest
from bench.__main__ import main, modules


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["bench", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_an_unknown_name_is_refused_before_anything_is_measured(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "motion", "peers") == 2
    written = capsys.readouterr()
    assert "nothing is called peers: there are tcp, pty, fleet, " in written.err
    assert written.out == ""


def test_the_help_lists_every_module_with_its_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "--help") == 0
    lines = capsys.readouterr().out.splitlines()
    assert {"motion", "wbc", "worlds"} <= modules().keys()
    for name, text in modules().items():
        assert text.strip()
        assert any(line.split()[:1] == [name] and line.endswith(text) for line in lines)
