"""What is the same for all kinds of devices."""

from __future__ import annotations

from dataclasses import replace

import pytest

from steptwin.drivers.kind import AddressSelection, AnyDriverKind, EndedMotion
from steptwin.drivers.kinds import DRIVERS, clear_line, others_there, register
from steptwin.drivers.m1486.kind import M1486_DRIVER
from steptwin.drivers.mic488.kind import MIC488_DRIVER
from steptwin.errors import Misuse


@pytest.mark.parametrize(
    ("position", "detail", "text"),
    [
        (None, "", "M1: overdue"),
        (2.5, "", "M1: overdue at 2.5 mm"),
        (0.0, "why", "M1: overdue at 0 mm (why)"),
        (None, "why", "M1: overdue (why)"),
    ],
)
def test_the_end_of_a_motion_in_words(position: float | None, detail: str, text: str) -> None:
    assert str(EndedMotion(1, "M1", False, "overdue", position, "mm", 1.0, detail)) == text


def test_what_else_an_address_may_lead_to() -> None:
    assert others_there(MIC488_DRIVER) == ". If it is an M1486, put ',kind=m1486' behind the address"
    assert others_there(M1486_DRIVER) == ""  # bytes of M1486 commands do a MIC488 no harm


def test_bytes_of_the_other_kinds_are_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    cleared: list[tuple[str, int]] = []
    monkeypatch.setitem(DRIVERS, "m1486", _with_clear(cleared))
    clear_line(MIC488_DRIVER, "memory", 38400)
    assert cleared == [("memory", 38400)]
    clear_line(DRIVERS["m1486"], "memory", 38400)
    assert cleared == [("memory", 38400)]


def test_kinds_have_names_and_options_of_their_own() -> None:
    assert list(DRIVERS) == ["mic488", "m1486"]
    with pytest.raises(Misuse, match="a MIC488 has mic488 already"):
        register(_kind("mic488", "slot"))
    with pytest.raises(Misuse, match="a MIC488 has unit already"):
        register(_kind("other", "unit"))
    assert list(DRIVERS) == ["mic488", "m1486"]


def _kind(name: str, option: str) -> AnyDriverKind:
    return replace(M1486_DRIVER, name=name, selection=AddressSelection(option=option, variant="model", forms="model=X"))


def _with_clear(cleared: list[tuple[str, int]]) -> AnyDriverKind:
    return replace(M1486_DRIVER, clear=lambda place, baud: cleared.append((place, baud)))
