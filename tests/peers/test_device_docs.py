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
    programs = [program for program in blocks("drivers.md", "python") if HERE in program]
    assert len(programs) == 4
    for program in programs:
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


def test_the_m1486s_part(
    serve_m1486: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    here = "tcp://127.0.0.1:5022"
    twin = serve_m1486("--variant", "B", "--chain", "0,7", "--tcp", "127.0.0.1:0")
    place = f"tcp://127.0.0.1:{twin.tcp_port}"
    (program,) = (program for program in blocks("drivers.md", "python") if here in program)
    exec(compile(program.replace(here, place), "drivers.md", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    promised = re.findall(r"print\(.*\)  # (chip.*)", program)
    assert promised
    assert set(promised) <= set(printed)
    (commands,) = blocks("drivers.md", "sh")
    monkeypatch.setenv("STEPTWIN_DEVICE", f"{place},chip=7")
    for line in commands.splitlines()[1:]:
        monkeypatch.setattr("sys.argv", shlex.split(line.replace("examples/", f"{DOCS.parent}/examples/")))
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0, (line, capsys.readouterr().err)
