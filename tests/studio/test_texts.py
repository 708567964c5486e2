"""Fixed sets of sentences that the service gives in English, and that the page has in Polish."""

from __future__ import annotations

import re
from pathlib import Path

from steptwin.m1486.microsteps import UNIT
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS
from steptwin.verify import m1486, mic488
from steptwin.world.faults.kinds import rows

TEXTS = Path(__file__).parents[2] / "studio-web/src/text"
ENTRY = re.compile(r'^  (?:"((?:[^"\\]|\\.)*)"|(\w+)):', re.MULTILINE)


def polish(name: str) -> set[str]:
    return {quoted or bare for quoted, bare in ENTRY.findall((TEXTS / name).read_text("utf-8"))}


def test_kinds_of_faults_and_checks_are_polish_and_nothing_else_is_there() -> None:
    assert polish("meanings.ts") == {
        *(kind.meaning for kind in rows()),
        *(check.what for check in (*mic488.CHECKS, *m1486.CHECKS)),
    }


def test_states_are_polish() -> None:
    assert {*AXIS_STATUS_TEXTS.values(), *CONTROLLER_STATUS_TEXTS.values()} <= polish("words.ts")


def test_the_unit_of_a_chip_is_polish() -> None:
    assert {UNIT, f"{UNIT}/s"} <= polish("words.ts")
