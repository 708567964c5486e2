"""``steptwin datasheet``: of a kind, and of a controller as it is configured in a running twin."""

from __future__ import annotations

import json

from toy.kind import registered
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.datasheet import Datasheet
from steptwin.jsonvalues import read
from steptwin.mic488.datasheet import datasheet_of


def printed(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["datasheet", *arguments])
    assert result.exit_code == code, result.output
    return result.output


def test_of_a_firmware_and_of_a_type() -> None:
    """Manual 1.23, table 3.2: control registers begin at 1000; 4.6: POS_ACT is the 20th."""
    lines = printed("mic488", "--variant", "1.23").splitlines()
    assert lines[0] == "MIC488 1.23"
    (position,) = [line.split() for line in lines if line.startswith("M1_POS_ACT")]
    assert position[:6] == ["M1_POS_ACT", "rw", "holding", "register", "1020", "imp"]
    (run,) = [line for line in printed("m1486").splitlines() if line.startswith("R ")]
    assert run.split()[:3] == ["R", "moves", "Makes"]


def test_its_json_is_read_back() -> None:
    assert read(Datasheet, json.loads(printed("mic488", "--json"))) == datasheet_of("1.70")


def test_a_kind_of_ones_own_has_one() -> None:
    with registered():
        assert "position  r" in printed("toy")


def test_what_is_not_there() -> None:
    """Errors are raised here; `main` makes messages of them."""
    for arguments, text in (
        (("mic489",), "no kind of controllers is called 'mic489': there are mic488, m1486"),
        (("mic488", "--variant", "9"), "9"),
        (("mic488", "-d", "x"), "KIND and --device exclude each other"),
        (("--variant", "1.23"), "--variant is for a KIND"),
    ):
        result = CliRunner().invoke(app, ["datasheet", *arguments])
        assert result.exit_code != 0
        assert text in f"{result.exception}", arguments
