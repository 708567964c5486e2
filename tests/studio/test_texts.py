"""Sentences that the service gives in English, and that the page has in Polish."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache

from tests.support.sentences import ROOT, Sentences, has_words, table

from steptwin.datasheet import Datasheet
from steptwin.m1486.datasheet import datasheet_of
from steptwin.m1486.microsteps import UNIT
from steptwin.m1486.variants import VARIANTS
from steptwin.mic488 import configform
from steptwin.mic488.points import AXIS_SHORT_NAMES, SHORT_NAMES
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS, ROWS
from steptwin.simulation.faults.kinds import rows
from steptwin.verify import m1486, mic488

SOURCES = ROOT / "src/steptwin"
NUMBER = re.compile(r"(?<=General purpose )\d+")
ENDINGS = {"{text} (in program order)", "{text} (when received)", "{text} (when compressed)"}
GOLDEN = [
    *(ROOT / "tests/wbc/golden" / name for name in ("programs.txt", "tables.txt", "other_languages.txt")),
    *sorted((ROOT / "tests/m1486/golden").glob("*.golden")),
]
FINDING = re.compile(r"^.+?:\d+:\d+: (?:error|warning|note) [MW]\d+: (.*)$|^ +\d* *= (?!suggestion:)(.*)$", re.MULTILINE)
PLACE = re.compile(r"\{#?\w+\}")
CONTINUED = re.compile(r'"\s+f?"')
MOST_PARTS = 3
OTHERS = ("findings.ts", "descriptions.ts")


@cache
def polish() -> Sentences:
    tables = ("datasheets.ts", "meanings.ts", *OTHERS)
    return Sentences(sentence for name in tables for sentence in table(name))


def found_in_programs() -> Iterator[str]:
    for path in GOLDEN:
        for message, hint in FINDING.findall(path.read_text("utf-8")):
            yield message or hint


def test_findings_of_the_checkers_are_polish() -> None:
    found = {text for text in found_in_programs() if has_words(text)}
    assert len(found) > 500
    assert sorted(text for text in found if not polish().fits(text)) == []


def test_permitted_values_and_defaults_of_faults_are_polish() -> None:
    words = {
        text for kind in rows() for one in kind.parameters for text in (one.permitted, one.otherwise) if text and not one.words
    }
    assert sorted(text for text in words if not polish().fits(text)) == []


def test_nothing_is_polish_that_is_not_said() -> None:
    """Each piece of a sentence is in the sources or in a finding of the golden files, or made of three parts that are."""
    pages = (ROOT / "studio-web/src/lib/protocol").glob("*.ts")
    sources = "\n".join(path.read_text("utf-8") for path in (*SOURCES.rglob("*.py"), *pages))
    sources = CONTINUED.sub("", sources).replace("\\\\", "\\") + "\n".join(found_in_programs())
    pieces = {piece for sentence in table(*OTHERS) for piece in PLACE.split(sentence)}
    assert sorted(piece for piece in pieces if parts(piece, sources) > MOST_PARTS) == []


def parts(piece: str, sources: str) -> int:
    """Of how many stretches of words of the sources a piece of a sentence is made."""
    count = 0
    while piece:
        ends = [len(piece), *(found.start() for found in re.finditer(r"(?<=\S) ", piece))]
        end = next((end for end in sorted(ends, reverse=True) if piece[:end] in sources), len(piece) + 1)
        if end > len(piece):
            return MOST_PARTS + 1
        piece, count = piece[end:].lstrip(), count + 1
    return count


def test_kinds_of_faults_and_checks_are_polish_and_nothing_else_is_there() -> None:
    assert table("meanings.ts") == {
        *(kind.meaning for kind in rows()),
        *(check.what for check in (*mic488.CHECKS, *m1486.CHECKS)),
    }


def of_chip(sheet: Datasheet) -> Iterable[str]:
    for point in sheet.points:
        yield NUMBER.sub("{n}", point.meaning)
    for command in sheet.commands:
        yield command.meaning.rpartition(" (")[0]


def test_meanings_of_data_sheets_are_polish_and_nothing_else_is_there() -> None:
    assert table("datasheets.ts") - ENDINGS == {
        *(row.meaning for row in ROWS),
        *(short.meaning for short in (*SHORT_NAMES, *AXIS_SHORT_NAMES) if short.meaning),
        *(row.meaning for row in (*configform._AXIS.values(), *configform._OTHERS.values())),
        *(meaning for variant in VARIANTS for meaning in of_chip(datasheet_of(variant))),
        *(parameter.meaning for kind in rows() for parameter in kind.parameters),
    } - table("meanings.ts")


def test_states_are_polish() -> None:
    assert {*AXIS_STATUS_TEXTS.values(), *CONTROLLER_STATUS_TEXTS.values()} <= table("words.ts")


def test_the_unit_of_a_chip_is_polish() -> None:
    assert {UNIT, f"{UNIT}/s"} <= table("words.ts")
