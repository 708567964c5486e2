"""What the pages about drivers and devices show, done to a served demo."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.cli import main

DOCS = Path(__file__).parents[2] / "docs"
HERE = "tcp://127.0.0.1:5020"

pytestmark = pytest.mark.peers


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", (DOCS / page).read_text(), re.MULTILINE | re.DOTALL)


def test_the_programs_run(serve: Callable[..., Any], capsys: pytest.CaptureFixture[str]) -> None:
    twin = serve("--demo")
    programs = blocks("drivers.md", "python")
    assert len(programs) == 4
    for program in programs:
        assert HERE in program
        exec(compile(program.replace(HERE, f"tcp://127.0.0.1:{twin.tcp_port}"), "drivers.md", "exec"), {})
        printed = capsys.readouterr().out.splitlines()
        assert printed
        for promised in re.findall(r"print\(.*\)  # (M1.*)", program):
            assert promised in printed


def test_the_commands_run(serve: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    place = f"tcp://127.0.0.1:{serve('--demo').tcp_port}"
    monkeypatch.setenv("STEPTWIN_DEVICE", f"{place},timeout=5")
    lines = [shlex.split(line, comments=True) for block in blocks("devices.md", "sh") for line in block.splitlines()]
    assert len(lines) >= 12
    for typed in filter(None, lines):
        monkeypatch.setattr("sys.argv", [argument.replace(HERE, place) for argument in typed])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0, (typed, capsys.readouterr().err)
