"""Sentences that the service gives in English, and that the page has in Polish."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import pytest

from steptwin.commands.demo import FOLDER, describe_demo
from steptwin.datasheet import Datasheet
from steptwin.files.world import World
from steptwin.m1486.datasheet import datasheet_of
from steptwin.m1486.microsteps import UNIT
from steptwin.m1486.variants import VARIANTS
from steptwin.mic488 import configform
from steptwin.mic488.points import AXIS_SHORT_NAMES, SHORT_NAMES
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS, ROWS
from steptwin.subject.events import payload_of
from steptwin.subject.payloads import is_shown
from steptwin.verify import m1486, mic488
from steptwin.world.faults.kinds import rows

ROOT = Path(__file__).parents[2]
TEXTS = ROOT / "studio-web/src/text"
ENTRY = re.compile(r'^  (?:"((?:[^"\\]|\\.)*)"|(\w+)):', re.MULTILINE)
NUMBER = re.compile(r"(?<=General purpose )\d+")
ENDINGS = {"{text} (in program order)", "{text} (when received)", "{text} (when compressed)"}


def polish(name: str) -> set[str]:
    return {quoted or bare for quoted, bare in ENTRY.findall((TEXTS / name).read_text("utf-8"))}


def test_kinds_of_faults_and_checks_are_polish_and_nothing_else_is_there() -> None:
    assert polish("meanings.ts") == {
        *(kind.meaning for kind in rows()),
        *(check.what for check in (*mic488.CHECKS, *m1486.CHECKS)),
    }


def of_chip(sheet: Datasheet) -> Iterable[str]:
    for point in sheet.points:
        yield NUMBER.sub("{n}", point.meaning)
    for command in sheet.commands:
        yield command.meaning.rpartition(" (")[0]


def test_meanings_of_data_sheets_are_polish_and_nothing_else_is_there() -> None:
    assert polish("datasheets.ts") - ENDINGS == {
        *(row.meaning for row in ROWS),
        *(short.meaning for short in (*SHORT_NAMES, *AXIS_SHORT_NAMES) if short.meaning),
        *(row.meaning for row in (*configform._AXIS.values(), *configform._OTHERS.values())),
        *(meaning for variant in VARIANTS for meaning in of_chip(datasheet_of(variant))),
        *(parameter.meaning for kind in rows() for parameter in kind.parameters),
    } - polish("meanings.ts")


@pytest.mark.parametrize("name", ["demo", "hoist/hoist", "feeder", "handwheel", "two_stations/two_stations"])
def test_events_of_the_examples_are_polish(name: str) -> None:
    if name == "demo":
        world = World.from_toml(describe_demo(free_ports=True), {"demo.prg": (FOLDER / "demo.prg").read_bytes()})
    else:
        world = World.load(ROOT / f"examples/worlds/{name}.toml")
    with world:
        world.run(for_=12.0)
        shown = [payload.text for record in world.trace if is_shown(payload := payload_of(record))]
    assert shown
    known = "|".join(re.sub(r"\\\{\w+\\\}", ".+", re.escape(form)) for form in polish("happened.ts"))
    assert [text for text in shown if not re.fullmatch(known, text)] == []


def test_states_are_polish() -> None:
    assert {*AXIS_STATUS_TEXTS.values(), *CONTROLLER_STATUS_TEXTS.values()} <= polish("words.ts")


def test_the_unit_of_a_chip_is_polish() -> None:
    assert {UNIT, f"{UNIT}/s"} <= polish("words.ts")
