"""After a stop of a chip nothing begins that was asked for before it: types, motions, moments and ways, in one table.

In virtual time; `tests/soak/test_stops.py` has drawn moments.
"""

from __future__ import annotations

import pytest
from chip_rig import ChipWire, chip_driver, chip_line
from chip_stops import ASKED, FAMILIES, WAYS, trial

from steptwin.drivers import Unconfirmed
from steptwin.drivers.m1486 import M1486
from steptwin.machine import SECOND

MOMENTS_S = {"A": (0.0, 0.001, 0.3), "B": (0.0, 0.001, 0.3), "C": (0.0, 0.002, 0.3), "E1": (0.0, 0.3, 1.2), "E2": (0.0, 0.8, 1.6)}
"""At once, in the time that commands take until they move something, and after it."""


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("family", FAMILIES)
def test_nothing_begins_after_a_stop_that_was_asked_for_before_it(family: str, asked: str, way: str) -> None:
    wrong = [fault for delay_s in MOMENTS_S[family] if (fault := trial(family, asked, way, delay_s)) is not None]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("delay_s", [0.0, 0.3, 0.7])
def test_wrong_data_that_end_nothing_are_followed_by_a_second_kill(delay_s: float) -> None:
    """With function 44 ON a motion in the EEPROM is ended when it has begun, and only that confirms the stop."""
    wire = ChipWire("E1", (7,))
    chip = chip_driver(wire, 7)
    chip.set_function(44, True)
    wire.sleep(1.0)
    chip.run(1)
    wire.sleep(delay_s)
    assert chip.stop() is (delay_s == 0.7)  # then all is known: a motion that has begun, and no program
    confirmed = wire.now
    wire.sleep(5.0)
    assert not [event for _, event in wire.happened if event.code == "moves" and event.time > confirmed]
    assert not wire.moving(7)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_stop_of_a_chip_of_which_nothing_is_known_is_confirmed_by_its_second_kill(family: str) -> None:
    """Another process has asked for the motion; the one that stops has opened the line only."""
    wire = ChipWire(family, (7,))
    chip_driver(wire, 7).run(1)
    wire.sleep(0.2)
    wire.sent.clear()
    stopping = M1486(chip_line(wire), 7)
    stopping.open_line()
    assert stopping.stop() is False
    confirmed = wire.now
    assert b"".join(data for _, data in wire.sent).count(b"k\r") == 3  # twice at once, to a chip that may not echo
    wire.sleep(5.0)
    assert not [event for _, event in wire.happened if event.code == "moves" and event.time > confirmed]
    assert not wire.moving(7)


def test_a_stop_that_does_not_get_through_is_not_confirmed() -> None:
    wire = ChipWire("E1", (7,))
    chip = chip_driver(wire, 7)
    chip.run(1)
    wire.severed = True
    with pytest.raises(Unconfirmed):
        chip.stop()


def test_a_program_that_stops_is_told() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.download("[\n@5\nF6400\nR\nW100\nJ5\n]")
    wire.sleep(0.5)
    assert chip.stop() is True
    stood = wire.now + SECOND
    wire.sleep(5.0)
    assert not [event for _, event in wire.happened if event.code == "moves" and event.time > stood - SECOND]
    # With function 44 ON it goes on, and that is told.
    chip.download("[\nT44\n@5\nF6400\nR\nW100\nJ5\n]")
    wire.sleep(0.5)
    assert chip.stop() is False
    wire.sleep(1.0)
    assert wire.moving(7) or wire.true(7)
