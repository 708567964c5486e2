"""Lines of a person at a terminal and of a script in a pipe."""

from __future__ import annotations

import builtins
import sys
from collections.abc import Sequence

import pytest

from steptwin.cli.typedlines import typed_lines

SUSPENSION_S = 7.0


def lines(monkeypatch: pytest.MonkeyPatch, inputs: Sequence[float | str], *, interactive: bool) -> list[str]:
    """What is taken of ``inputs``; a number is a time that passes, in s, while the program does not run."""
    now = 100.0
    remaining = iter(inputs)

    def fake_input(_: str) -> str:
        nonlocal now
        for one in remaining:
            if isinstance(one, str):
                return one
            now += one
        raise EOFError

    monkeypatch.setattr(builtins, "input", fake_input)
    monkeypatch.setattr(sys.stdin, "isatty", lambda: interactive, raising=False)
    return list(typed_lines(lambda: "> ", lambda line: line == "stop", lambda: now))


def test_what_a_terminal_has_kept_during_a_suspension_is_left_out_except_stops(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    typed = ["M1_ACC", SUSPENSION_S, "M1_POS_ABS=5", "", "stop", "M1_POS_ABS=6"]
    assert lines(monkeypatch, typed, interactive=True) == ["M1_ACC", "", "stop"]
    assert capsys.readouterr().err.splitlines() == [
        f"'M1_POS_ABS={n}' is ignored: it was typed while this program was suspended" for n in (5, 6)
    ]


def test_the_lines_of_a_script_are_all_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    assert lines(monkeypatch, ["a", SUSPENSION_S, "b", "quit", "c"], interactive=False) == ["a", "b"]
