"""What the shell offers with Tab, asked as bash asks it."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import CliRunner

from steptwin.cli import app


def offered(typed: str, **environment: str) -> list[str]:
    """The words for the last one of a line that is being typed."""
    asked = {**os.environ, **environment, "_STEPTWIN_COMPLETE": "complete_bash", "COMP_WORDS": typed}
    ended = CliRunner().invoke(app, [], prog_name="steptwin", env={**asked, "COMP_CWORD": str(len(typed.split(" ")) - 1)})
    assert ended.exit_code == 0
    return ended.stdout.split()


@pytest.mark.parametrize(
    "command", ["serve mic488", "registers mic488", "check x.prg", "build x.prg", "run x.prg", "sniff /dev/x"]
)
def test_firmwares(command: str) -> None:
    assert offered(f"steptwin {command} --firmware 1.") == ["1.23", "1.40", "1.70"]


def test_types_of_the_m1486() -> None:
    assert offered("steptwin serve m1486 --variant E") == ["E1", "E2", "E12x", "E22x"]


def test_faults_and_what_they_take() -> None:
    assert offered("steptwin fault no") == ["noise", "no-answer", "no-air"]
    taken = offered("steptwin fault crc nth=3 ")
    assert {"every=", "probability=", "address="} <= set(taken)
    assert "nth=" not in taken


def test_running_twins_and_their_pins(serve: Callable[..., Any]) -> None:
    here = {"XDG_RUNTIME_DIR": serve("--name", "left").environment["XDG_RUNTIME_DIR"]}
    assert offered("steptwin state --device l", **here) == ["left", "left.mic488"]
    assert offered("steptwin info -d l", **here) == ["left", "left.mic488"]
    assert offered("steptwin pin IN2", **here) == ["IN2=", "IN20="]
    assert offered("steptwin pin --device left AIN", **here) == ["AIN1=", "AIN2="]


def test_without_a_twin_nothing_is_offered(tmp_path: Any) -> None:
    tmp_path.chmod(0o700)
    for typed in ("steptwin state --device ", "steptwin pin "):
        assert offered(typed, XDG_RUNTIME_DIR=str(tmp_path)) == []
