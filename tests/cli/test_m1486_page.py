"""docs/m1486.md: its commands are typed, its options are compared with the program's."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from steptwin.cli import app

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/m1486.md").read_text()


def commands(*names: str) -> list[list[str]]:
    """Arguments of the commands on the page that begin with these names."""
    blocks = re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    lines = [shlex.split(line, comments=True)[1:] for block in blocks for line in block.splitlines()]
    return [line for line in lines if line[0] in names]


@pytest.mark.parametrize("arguments", commands("run", "check"), ids=" ".join)
def test_commands_that_run_a_program(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    result = CliRunner().invoke(app, arguments)
    assert (result.exit_code, result.stderr) == (0, "")


def test_the_output_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (_, shown) = re.split(r"^```console\n", PAGE, maxsplit=1, flags=re.MULTILINE)
    printed = CliRunner().invoke(app, commands("run")[0]).stdout
    assert printed.splitlines()[:-1] == shown.partition("```")[0].splitlines()[:-1]  # the last has the wall's time


def test_commands_for_running_chips(serve_m1486: Callable[..., Any]) -> None:
    twin = serve_m1486("--variant", "B", "--chain", "0,7")
    typed = commands("pin", "state", "power-cycle")
    assert len(typed) == 5
    for arguments in typed:
        run = twin.command(*arguments)
        assert (run.returncode, run.stderr) == (0, ""), arguments


def test_every_option_of_serve_is_on_the_page() -> None:
    helped = CliRunner().invoke(app, ["serve", "m1486", "--help"]).stdout
    offered = set(re.findall(r"^  (--[a-z0-9-]+)", helped, re.MULTILINE)) - {"--help"}
    part = PAGE[PAGE.index("## Serve chips") : PAGE.index("## Timing")]
    rows = re.findall(r"^\| (`--.*?) \|", part, re.MULTILINE)
    assert {option for row in rows for option in re.findall(r"--[a-z0-9-]+", row)} == offered
