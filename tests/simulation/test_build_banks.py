"""Programs and position tables in the banks of a MIC488 of a world."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.wbc.check import check
from steptwin.wbc.image import build
from steptwin.wbc.positions import parse_positions

FILES = {
    "one.prg": b"OUT1 = ON\n",
    "two.prg": b"OUT2 = ON\n",
}


def world(keys: str, **files: bytes) -> World:
    return World.from_toml(f'[[mic488]]\nname = "a"\n{keys}\n', {**FILES, **files})


@pytest.mark.parametrize(
    ("keys", "banks"),
    [
        ('program = "one.prg"', {0: "one.prg"}),
        ('programs = "two.prg"', {0: "two.prg"}),
        ('programs = ["one.prg", "two.prg"]', {0: "one.prg", 1: "two.prg"}),
        ('programs = { 3 = "one.prg", 0 = "two.prg" }', {0: "two.prg", 3: "one.prg"}),
        ("", {}),
    ],
)
def test_programs_go_into_their_banks(keys: str, banks: dict[int, str]) -> None:
    made = world(keys)
    device = made.mic488["a"].device
    assert {bank: program.source.name for bank, program in device.program.banks.programs.items()} == banks
    assert recording_of(made).replay().mic488["a"].device.snapshot() == device.snapshot()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('programs = { 9999 = "one.prg" }', "'9999' is not a bank"),
        ('programs = { x = "one.prg" }', "'x' is not a bank: expected a number from 0 on"),
        ('programs = { 01 = "one.prg" }', "'01' is not a bank"),
        ('programs = { 900 = "one.prg" }', "programs: one.prg is for bank 900: firmware 1.70 has banks 0 to "),
        ('programs = { 6 = "one.prg" }', "programs: one.prg is for bank 6: firmware 1.70 has banks 0 to 5"),
        ('positions = { 900 = "a.csv" }', "positions: a.csv is for bank 900"),
        ("programs = 1", "1: expected a file, a list of files, or files by bank"),
        ("programs = [1]", "1: expected a text"),
        ('program = "one.prg"\nprograms = "two.prg"', "program and programs exclude each other"),
        ('programs = ["one.prg", "none.prg"]', "the content of the file 'none.prg' is not given"),
        ('programs = ["one.prg", "wrong.prg"]', "wrong.prg:1:1: error W1"),
    ],
)
def test_banks_that_cannot_be_filled_are_errors_of_the_description(keys: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        world(keys, **{"wrong.prg": b"NONSENSE 1\n"})


def test_names_of_positions_are_those_of_the_own_bank_or_of_the_only_table() -> None:
    files = {
        "go.prg": b"M1 = ON\nMOVEPTP @top\n",
        "a.csv": b"low;0;x;x;x\ntop;1;x;x;x\n",
        "b.csv": b"top;2;x;x;x\n",
    }
    programs = world('programs = ["go.prg", "one.prg", "go.prg"]\npositions = { 0 = "a.csv", 2 = "b.csv" }', **files)
    device = programs.mic488["a"].device
    assert device.program.banks.programs[0].steps != device.program.banks.programs[2].steps
    alone = world('programs = { 3 = "go.prg" }\npositions = { 1 = "a.csv" }', **files).mic488["a"].device
    assert alone.program.banks.programs[3].steps == device.program.banks.programs[0].steps
    with pytest.raises(Misuse, match="positions"):
        world('programs = { 3 = "go.prg" }\npositions = { 0 = "a.csv", 2 = "b.csv" }', **files)


def test_an_image_brings_its_own_positions_unless_the_bank_has_others() -> None:
    go, positions = b"M1 = ON\nMOVEPTP @top\n", b"low;0;x;x;x\ntop;1;x;x;x\n"
    table, _ = parse_positions(positions.decode())
    executable = check(go.decode(), table).executable
    assert executable is not None
    image, _ = build(executable, table)
    assert image is not None
    for keys, row in (("", 1.0), ('\npositions = { 2 = "b.csv" }', 7.0)):
        made = world('programs = { 2 = "go.wbc" }' + keys, **{"go.wbc": image, "b.csv": b"P0;0;x;x;x\nP1;7;x;x;x\n"})
        banks = made.mic488["a"].device.program.banks
        assert set(banks.positions) == {2}
        assert banks.positions[2].rows[1].values[0] == row


def test_what_is_doubtful_in_a_program_is_a_warning_with_its_place() -> None:
    program = b"MAIN:\nWAIT IN2 = ON\nJUMP MAIN\nINT_IN1:\nJUMP MAIN\n"
    (warning,) = world('program = "p.prg"', **{"p.prg": program}).blueprint.warnings
    assert warning.splitlines()[0] == "p.prg:4:1: warning W201: every path from the interrupt label of IN1 leaves without RETURN"
    assert world('program = "one.prg"').blueprint.warnings == []
