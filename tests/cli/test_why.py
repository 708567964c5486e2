"""``steptwin why``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from steptwin.cli import app

PRESS = Path(__file__).parents[2] / "examples" / "worlds" / "press" / "press.toml"
VALVE = """\
valve.out == 0 is true, since 3.206000 s (at 3.3455 s)
    3.206000 s  valve      valve.out became 0
    3.206000 s  safety     safety.no became 0
    3.198000 s  curtain    curtain became 0, a normally closed contact, safety follows after 8 ms
    3.198000 s  check      script check: presses curtain
"""
"""As docs/why.md shows it."""


def invoke(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("why") / "press.json"
    invoke("run", str(PRESS), "--for", "10s", "--session", str(file))
    return str(file)


def test_the_chain_of_a_condition(session: str) -> None:
    assert invoke("why", session, "valve.out == 0") == VALVE
    assert VALVE in (PRESS.parents[3] / "docs" / "why.md").read_text(encoding="utf-8")


def test_the_run_again_without_a_root(session: str) -> None:
    tried = invoke("why", session, "valve.out == 0", "--try-without").removeprefix(VALVE)
    assert tried in (PRESS.parents[3] / "docs" / "why.md").read_text(encoding="utf-8")
    assert tried.splitlines()[1:] == ["    3.198000 s  check      script check: presses curtain -> valve.out == 0 is false"]


def test_more_causes_than_are_shown(session: str) -> None:
    asked = "why", session, "cell", "--at", "2.9s"
    first, everything = (invoke(*asked, *more).splitlines() for more in ((), ("--all",)))
    assert first[-1].strip() == "(further present states are not shown: --all shows more)"
    assert set(first[:-1]) < set(everything)


def test_the_chain_at_a_moment_as_json(session: str) -> None:
    told = json.loads(invoke("why", session, "cell.OUT1 = 0", "--at", "2.7s", "--json"))
    assert told["at_ns"] == "2700000000"
    assert told["since_ns"] == "2624000000"
    link = told["links"][1]
    assert (link["time_ns"], link["subject"], link["text"]) == ("2624000000", "cell", "line 15 `ask = OFF` was executed")
    assert link["messages"]["text"]["id"] == "why.was-executed"


def test_what_a_program_waits_for(session: str) -> None:
    lines = invoke("why", session, "cell", "--at", "1.5s").splitlines()
    assert lines[0] == "cell waits at line 12 `WAIT hands = ON`, since 0.012000 s (at 1.5 s)"
    assert lines[1].split(None, 3)[3] == "cell.IN1 is 0 from the beginning, driven by hands.out"
