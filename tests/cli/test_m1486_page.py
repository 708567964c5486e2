"""docs/m1486/run.md: what it shows is what is printed; the options of docs/reference/serve.md are the program's."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from steptwin.cli import app

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/m1486/run.md").read_text()
OPTIONS = (ROOT / "docs/reference/serve.md").read_text()


def commands(*names: str) -> list[list[str]]:
    """Arguments of the commands on the page that begin with these names."""
    blocks = re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    lines = [shlex.split(line, comments=True)[1:] for block in blocks for line in block.splitlines()]
    return [line for line in lines if line[0] in names]


def test_the_output_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (_, shown) = re.split(r"^```console\n", PAGE, maxsplit=1, flags=re.MULTILINE)
    printed = CliRunner().invoke(app, commands("run")[0]).stdout
    assert printed.splitlines()[:-1] == shown.partition("```")[0].splitlines()[:-1]  # the last has the wall's time


def test_every_option_of_serve_is_on_the_page() -> None:
    helped = CliRunner().invoke(app, ["serve", "m1486", "--help"]).stdout
    offered = set(re.findall(r"^  (--[a-z0-9-]+)", helped, re.MULTILINE)) - {"--help"}
    part = OPTIONS[OPTIONS.index("## Chips") :]
    rows = re.findall(r"^\| (`--.*?) \|", part, re.MULTILINE)
    assert {option for row in rows for option in re.findall(r"--[a-z0-9-]+", row)} == offered
