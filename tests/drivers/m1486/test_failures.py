"""Chips that do not answer, restart or cannot be stopped, and lines that are cut."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from chip_rig import KNOWN, ChipWire, Fault, chip_driver, typed
from transcripts import suspending

from steptwin.controller import SECOND
from steptwin.drivers import SentLate, Unconfirmed
from steptwin.drivers.m1486 import (
    M1486,
    Busy,
    ChipReason,
    ChipSettings,
    DoubtfulMove,
    Garbled,
    NoEcho,
    PositionUnknown,
    Restarted,
    WrongType,
)
from steptwin.errors import LineFailure


def test_who_does_not_echo_is_told() -> None:
    wire = ChipWire("B", (7,))
    with pytest.raises(NoEcho, match="chip 3 does not echo: it is off, has another address or baud rate"):
        chip_driver(wire, 3)


@pytest.mark.parametrize("call", [lambda c: c.move_to(0.25), lambda c: c.move_by(-0.25), lambda c: c.position()])
def test_a_chip_that_was_switched_off_is_not_moved_with_what_it_was_set_to(call: Callable[[M1486], object]) -> None:
    """With M1 it would drop f16 as wrong data, and R would make the default move of a thousand steps."""
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.configure(microstep=4)
    chip.set_position(100.0)
    wire.chip.power_cycle(wire.now)
    with pytest.raises(Restarted, match="chip 7 was switched off or reset meanwhile"):
        call(chip)
    assert wire.true() == 0
    assert chip.settings == ChipSettings()
    assert chip.counter() == 0
    with pytest.raises(PositionUnknown):
        chip.position()


def test_after_a_restart_a_busy_chip_is_not_held_by_an_earlier_kill() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.set_function(51, False)
    chip.run(1)
    chip.stop()
    wire.sleep(1.0)
    wire.chip.power_cycle(wire.now)
    with pytest.raises(Restarted):
        chip.variable()
    chip.set_function(51, False)
    chip.run(1)
    with pytest.raises(Busy, match="chip 7 is not done with a run without end: wait for its end or stop it"):
        chip.variable()


def test_after_a_restart_the_motion_before_it_is_over() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.run(1)
    wire.sleep(1.0)
    wire.chip.power_cycle(wire.now)
    with pytest.raises(Restarted):
        chip.flags()
    assert chip.wait().reason is ChipReason.REST


def test_a_chip_that_is_switched_off_between_the_distance_and_the_run_does_not_move() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.configure(microstep=4)

    def cycle(data: bytes) -> None:
        if data == b"r":
            wire.before_each = None
            wire.chip.power_cycle(wire.now)

    wire.before_each = cycle
    with pytest.raises(Restarted):
        chip.move_by(0.25)
    wire.sleep(5.0)
    assert wire.true() == 0


def test_a_cut_line_is_told() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.run(1)
    wire.severed = True
    with pytest.raises(Unconfirmed, match="chip 7 could not be stopped: it cannot be reached and continues its last command"):
        chip.stop()
    assert chip.wait(1.0, check=False).reason in (ChipReason.COMMUNICATION, ChipReason.STOPPED)
    wire.severed = False
    chip.stop()
    wire.sleep(1.0)
    assert not wire.moving()


def test_a_line_that_is_cut_when_a_move_begins_leaves_it_in_doubt() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)

    def cut(data: bytes) -> None:
        wire.severed = wire.severed or (data == b"\r" and wire.sent[-1][1] == b"r")

    wire.before_each = cut
    with pytest.raises(DoubtfulMove, match="it is unknown whether chip 7 has begun a move") as caught:
        chip.move_by(10.0)
    assert caught.value.uncertain
    wire.before_each, wire.severed = None, False
    wire.sleep(2.0)
    assert chip.counter() == wire.true() == 0


def test_a_move_that_was_sent_too_late_is_stopped_and_said_to_be_so() -> None:
    """The process is suspended while it writes the CR of the command that moves."""
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.configure(**KNOWN)
    begin = wire.true()

    def suspend(data: bytes) -> None:
        if data == b"\r" and wire.sent[-1][1] == b"r":
            wire.before_each = None
            wire.sleep(70.0)

    wire.before_each = suspend
    with pytest.raises(SentLate, match="was sent more than"):
        chip.move_by(500.0)
    wire.sleep(2.0)
    assert not wire.moving()
    assert 0 <= wire.true() - begin < 64 * 30
    assert chip.wait(check=False).reason is ChipReason.STOPPED


def test_a_chip_that_cannot_be_told_to_stop_is_told_with_the_first_cause() -> None:
    """That nothing came back to Kill, whatever was tried afterwards."""
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    wire.severed = True
    with pytest.raises(Unconfirmed) as caught:
        chip.stop()
    assert "(memory: no answer to 'chip 7: % k' within 0.5 s" in str(caught.value)
    assert "does not echo" not in str(caught.value)
    assert "does not echo" in str(caught.value.__cause__)


def test_what_is_not_stored_takes_no_time_of_the_memory() -> None:
    """An E type writes commands into its EEPROM; C75 acts when it is received."""
    wire = ChipWire("E1")
    chip = chip_driver(wire)
    wire.sleep(5.0)
    shared = chip._driver._unit.shared
    chip.recover()
    assert shared.ready_at <= wire.now
    chip.set_flag(80, True)
    assert shared.ready_at > wire.now


def test_an_end_says_how_long_it_was_waited_for() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**KNOWN)
    chip.move_by(100.0)
    wire.sleep(0.1)
    begin = wire.now
    end = chip.wait()
    assert end.after_s == pytest.approx((wire.now - begin) / SECOND, abs=0.05)
    assert 0.1 < end.after_s < 10.0


@pytest.mark.parametrize("number", [2, 3])
def test_bytes_that_differ_at_every_reading_are_no_value(number: int) -> None:
    """The line has no checksum: a byte counts when it was the same twice, of four readings."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    readings = 0

    def change(data: bytes) -> None:
        nonlocal readings
        if data == b"u1":
            readings += 1
            if readings < number + 2:
                wire.chip.drive.set_counter(64 * readings, wire.now)

    wire.before_each = change
    if number == 2:
        assert chip.counter() == 64 * 3
        assert readings == 4
        return
    with pytest.raises(LineFailure, match=r"^memory: the chip: what U1 U2 U3 sends differs at every reading$"):
        chip.counter()
    assert readings == 4


def test_a_letter_that_no_type_has_is_told() -> None:
    """Function 57 may have put a report before it, so that is switched off, and it is read once more."""
    wire = ChipWire("B")

    def change(data: bytes) -> None:
        if data == b"u20" and typed(wire).count("u20 ") == 17:
            wire.chip.variant = replace(wire.chip.variant, type_letter=0x5A)

    wire.before_each = change
    with pytest.raises(WrongType, match=r"^memory: the chip reports the type letter 5AH, which no M1486 has$"):
        chip_driver(wire)
    assert typed(wire).count("c57") == 1


def test_a_chip_that_did_not_answer_is_asked_three_times_whether_it_still_echoes() -> None:
    """Its echo is garbled each time, so it counts as switched off."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    asked = 0

    def disturb(data: bytes) -> None:
        nonlocal asked
        wire.severed = data == b"u20"
        if data == b"xf":
            asked += 1
            wire.inject(b"z")

    wire.before_each = disturb
    wire.sent.clear()
    with pytest.raises(NoEcho):
        chip.counter()
    assert asked == 3 + 3
    assert typed(wire).startswith("u20xg xg xf xfxg xg xf xfxg xg xf xf")


def test_a_move_that_was_sent_too_late_leaves_the_position_unknown() -> None:
    """The program was suspended immediately before the CR of R; the motor is stopped afterwards."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**KNOWN)
    suspending(wire)(18, 1000.0, "sending")
    with pytest.raises(SentLate):
        chip.move_by(100.0)
    assert typed(wire).endswith("r % k ")
    wire.sleep(5.0)
    with pytest.raises(PositionUnknown):
        chip.position()


@pytest.mark.parametrize("call", [lambda chip: chip.command("t6"), lambda chip: chip.set_output(6, True)])
def test_a_command_before_a_comment_that_came_by_a_fault_may_have_acted(call: Callable[[M1486], object]) -> None:
    """A semicolon hides what follows from the chip, also what would make the command invalid (M-1)."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_output(1, True)  # its interface is known now
    wire.put(Fault("to chip", 5, "semicolon"))
    with pytest.raises(Garbled) as garbled:
        call(chip)
    assert garbled.value.uncertain
