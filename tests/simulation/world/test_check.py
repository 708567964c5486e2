"""All that is wrong with a description and the files that it names, with places in the description."""

from __future__ import annotations

import pytest

from steptwin.diagnostics import Severity
from steptwin.errors import Misuse
from steptwin.simulation.world.check import LONGEST_MESSAGE, diagnose

WORLD = '[[mic488]]\nname = "m"\nprogram = "m.prg"\npositions = "m.csv"\n'


def unreadable(name: str) -> bytes:
    raise Misuse(f"{name}: no such file")


def test_a_file_that_cannot_be_read_is_found_at_the_key_that_names_it() -> None:
    found = diagnose("w.toml", WORLD, unreadable).findings
    assert [(one.code, one.severity, one.message, WORLD[one.span.start : one.span.end]) for one in found] == [
        ("D009", Severity.ERROR, "m.prg: no such file", 'program = "m.prg"'),
        ("D009", Severity.ERROR, "m.csv: no such file", 'positions = "m.csv"'),
    ]


def test_nothing_is_found_where_nothing_is_wrong() -> None:
    found = diagnose("w.toml", WORLD, {"m.prg": b"END\n", "m.csv": b"A;1;2;3;4\n"}.__getitem__)
    assert found.findings == []
    assert [(source.name, of) for source, of in found.files] == [("m.csv", []), ("m.prg", [])]


def test_a_file_that_two_controllers_name_has_each_finding_once() -> None:
    world = "".join(f'[[mic488]]\nname = "{name}"\nprogram = "m.prg"\n' for name in "ab")
    found = diagnose("cell/w.toml", world, {"m.prg": b"M1 = ON\nHOME M1 10\nEND\n"}.__getitem__)
    assert found.findings == []
    ((source, of),) = found.files
    assert (source.name, [(one.code, one.severity) for one in of]) == ("cell/m.prg", [("W219", Severity.WARNING)])


@pytest.mark.parametrize("length", [LONGEST_MESSAGE, LONGEST_MESSAGE + 1])
def test_a_long_message_of_several_lines_is_cut(length: int) -> None:
    text = "x\n" * length

    def fails(name: str) -> bytes:
        raise Misuse(text[:length])

    found = diagnose("w.toml", WORLD, fails).findings
    assert [one.message for one in found] == [text[:LONGEST_MESSAGE] + ("…" if length > LONGEST_MESSAGE else "")] * 2


def test_a_description_that_cannot_be_read_is_found_too() -> None:
    (found,) = diagnose("w.toml", '[[mic488]]\nname = "m\n', unreadable).findings
    assert found.severity is Severity.ERROR
