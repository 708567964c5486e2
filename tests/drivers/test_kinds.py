"""What is the same for all kinds of devices."""

from __future__ import annotations

import pytest

from steptwin.drivers.kind import AddressSelection, DeviceMotion, DriverKind, EndedMotion, WantedMoves
from steptwin.drivers.kinds import DRIVERS, clear_line, others_there, register
from steptwin.drivers.m1486.kind import M1486_DRIVER, M1486Driver
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
    kind = _ClearingDriver()
    monkeypatch.setitem(DRIVERS, "m1486", kind)
    clear_line(MIC488_DRIVER, "memory", 38400)
    assert kind.cleared == [("memory", 38400)]
    clear_line(kind, "memory", 38400)
    assert kind.cleared == [("memory", 38400)]


def test_a_kind_that_lacks_a_method_is_refused_when_it_is_made() -> None:
    class Incomplete(DriverKind[object]):
        name = "incomplete"

        def move(self, moves: WantedMoves) -> DeviceMotion[object]:
            raise NotImplementedError

    with pytest.raises(TypeError, match=r"abstract methods? .*axes.*wait.*writing"):
        Incomplete()  # type: ignore[abstract]


def test_what_only_some_kinds_have() -> None:
    assert [M1486_DRIVER.offers(method) for method in (DriverKind.seek, DriverKind.enable)] == [True, False]
    assert [MIC488_DRIVER.offers(method) for method in (DriverKind.seek, DriverKind.enable)] == [False, True]
    with pytest.raises(Misuse, match=r"^a MIC488 has no seek$"):
        MIC488_DRIVER.seek(["1=-B8"])
    with pytest.raises(Misuse, match=r"^an M1486 has no disable$"):
        M1486_DRIVER.enable(NotImplemented, (1,), False)


def test_kinds_have_names_and_options_of_their_own() -> None:
    assert list(DRIVERS) == ["mic488", "m1486"]
    with pytest.raises(Misuse, match="a MIC488 has mic488 already"):
        register(_OtherDriver("mic488", "slot"))
    with pytest.raises(Misuse, match="a MIC488 has unit already"):
        register(_OtherDriver("other", "unit"))
    assert list(DRIVERS) == ["mic488", "m1486"]


class _OtherDriver(M1486Driver):
    def __init__(self, name: str, option: str) -> None:
        self.name = name
        self.selection = AddressSelection(option=option, variant="model", forms="model=X")


class _ClearingDriver(M1486Driver):
    def __init__(self) -> None:
        self.cleared: list[tuple[str, int]] = []

    def clear(self, place: str, baud: int) -> None:
        self.cleared.append((place, baud))
