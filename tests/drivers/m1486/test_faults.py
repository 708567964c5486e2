"""Every character of every exchange goes wrong once: no wrong motion, the right error, and the next reading is right again.

Chips 0 and 7 share the line; the driver of 7 does something, and chip 0, which was talked to before, must never move. A single
fault is told or overcome; what moves is done exactly as it was meant to or not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest
from chip_rig import KINDS, ChipWire, Direction, Fault, Kind, chip_line

from steptwin.controller import SECOND
from steptwin.drivers.m1486.failures import DoubtfulMove, FileGivenUp, Garbled
from steptwin.drivers.m1486.motion import ChipMoveFailed, ChipReason
from steptwin.drivers.m1486.sync import M1486
from steptwin.errors import LineFailure, Refusal, SteptwinError

FEWER: tuple[Kind, ...] = ("drop", "invert", "insert", "flip 0")
FILE = "[\nf640\nr\nl2\nb64\nr\ne\n]\n"


@dataclass(frozen=True)
class Operation:
    """``ends`` are the places, in minimum microsteps, the motor may stand at when it was done and when it was not."""

    do: Callable[[M1486], object]
    done: int = 0
    sure: bool = True
    """Whether it may be said again, so that a single fault cannot keep it from being done."""


def read(chip: M1486) -> None:
    assert chip.counter() == 0


def test_a_command_whose_echo_is_always_garbled_is_typed_three_times(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire("B", (7,))
    chip = M1486(chip_line(wire), 7)
    chip.open()
    carry = wire._carry

    def garble(direction: str, data: bytes, now: int) -> None:
        carry(direction, data.replace(b"v", b"w") if direction == "to host" else data, now)

    monkeypatch.setattr(wire, "_carry", garble)
    before = len(wire.sent)
    with pytest.raises(Garbled, match=r"'chip 7: v500' did not come back as it was sent: 'w.*; it was not executed"):
        chip.configure(velocity=500)
    assert b"".join(data for _, data in wire.sent[before:]).count(b"v500") == 3
    assert wire.chip.drive.velocity == 1000


OPERATIONS = {
    "read": Operation(read),
    "move_to": Operation(lambda chip: chip.move_to(39.0), 39 * 64, sure=False),
    "move_by": Operation(lambda chip: chip.move_by(-13.0), -13 * 64, sure=False),
    "seek": Operation(lambda chip: chip.seek(1, 13), 99 * 64, sure=False),
    "configure": Operation(lambda chip: chip.configure(velocity=1930, acceleration=3900)),
    "set_position": Operation(lambda chip: chip.set_position(93.0)),
    "set_output": Operation(lambda chip: chip.set_output(19, False)),
    "download": Operation(lambda chip: chip.download(FILE), 640 - 64 * 2, sure=False),
    "block": Operation(lambda chip: chip.run_block(["f192", "r", "w5", "r"]), 384, sure=False),
}


def ready() -> tuple[ChipWire, M1486, M1486]:
    wire = ChipWire("B", (0, 7), statement_ns=0)
    # The line the seek looks for goes high when the motor has come there; every other line has another level.
    for chip in wire.chips.values():
        for line in (4, 5, 6, 7, 12, 13, 14, 15, 20, 21):
            chip.set_pin(f"B{line}", 0, wire.now)
    line = chip_line(wire)
    other, chip = M1486(line, 0, variant="B"), M1486(line, 7, variant="B")
    chip.open()
    chip.configure(start_stop=200, acceleration=5000, velocity=1000, profile=25000, microstep=1, qualification=1)
    other.open()
    return wire, other, chip


def prepare(wire: ChipWire, chip: M1486) -> None:
    """Counter 0 again, and the line the seek looks for."""
    wire.chips[7].set_pin("B13", 0, wire.now)
    wire.put()
    chip.set_position(0.0)


def rest(wire: ChipWire, name: str, begin: int) -> int:
    """Where the motor of chip 7 comes to rest; the seek's line goes high under way."""
    if name == "seek":
        while wire.moving(7) and wire.true(7) - begin < 99 * 64:
            wire.sleep(0.05)
        wire.chips[7].set_pin("B13", 1, wire.now)
    wire.sleep(3.0)
    return wire.true(7)


def cases(name: str) -> Iterator[Fault]:
    """Faults at every character from the first that is no question: those are the same everywhere, and `read` has them."""
    wire, _, chip = ready()
    begin: dict[Direction, int] = {"to chip": 0, "to host": 0} if name == "read" else {}

    def look(data: bytes) -> None:
        if not begin and data[:1] not in b"u\r":
            begin.update(wire.passed)

    wire.before_each = look
    wire.put()
    OPERATIONS[name].do(chip)
    for direction, count in wire.passed.items():
        for index in range(begin[direction], count):
            for kind in KINDS[index % 4 :: 4] if name == "move_to" else (FEWER[index % len(FEWER)],):
                yield Fault(direction, index, kind)


def attempt(operation: Operation, chip: M1486) -> SteptwinError | None:
    try:
        operation.do(chip)
    except (LineFailure, Refusal) as error:
        return error
    return None


def check_recovery(wire: ChipWire, chip: M1486) -> None:
    wire.put()
    assert wire.true(0) == 0
    assert chip.counter() == wire.chips[7].drive.counter_u(wire.now)


@pytest.mark.parametrize("name", OPERATIONS)
def test_a_fault_at_every_character_of_every_exchange(name: str) -> None:
    """The same chips and driver go from fault to fault, so that what one leaves behind would show in the next."""
    operation = OPERATIONS[name]
    wire, other, chip = ready()
    count = 0
    for fault in cases(name):
        begin = wire.true(7)
        wire.put(fault)
        error = attempt(operation, chip)
        wire.faults.clear()
        moved = rest(wire, name, begin) - begin
        if name == "seek" and moved:
            assert 98 * 64 <= moved <= 118 * 64, f"{fault}: {error}"
            moved = operation.done
        if error is None:
            assert moved == operation.done, fault
        else:
            assert not operation.sure, f"{fault}: {error}"
            if isinstance(error, ChipMoveFailed):
                assert error.end.reason is ChipReason.CUT
                moved = min(moved, 0)
            assert moved in (0, operation.done), f"{fault}: {error}"
            uncertain = getattr(error, "uncertain", False)
            assert isinstance(error, FileGivenUp) or uncertain == ("is unknown" in str(error)), f"{fault}: {error}"
            if not uncertain:
                assert moved == 0, f"{fault}: {error}"
            if isinstance(error, FileGivenUp):
                assert "nothing of it runs" in str(error)
        if isinstance(error, DoubtfulMove) and name in ("download", "block"):
            chip.reset(force=True)  # it may still wait for the end of the file
        check_recovery(wire, chip)
        count += 1
        if error is not None:
            assert other.counter() == 0
            wire, other, chip = ready()
        else:
            prepare(wire, chip)
    assert count >= 4


def test_only_what_moves_is_ever_in_doubt() -> None:
    """A move whose R may have been heard: that is said, and position tells afterwards."""
    wire, _, chip = ready()
    wire.put(Fault("to chip", next_cr(), "flip 0"))
    with pytest.raises(DoubtfulMove, match="it is unknown whether chip 7 has begun a move: the command was sent once"):
        chip.move_to(39.0)
    wire.sleep(5.0)
    assert wire.true(7) == 0
    assert chip.position() == 0.0


def next_cr() -> int:
    """The number of the character that is R's CR in a move."""
    wire, _, chip = ready()
    wire.put()
    chip.move_to(39.0)
    return wire.passed["to chip"] - 1


def test_a_stop_with_a_fault_at_every_character() -> None:
    wire, _, chip = ready()
    chip.run(1)
    wire.put()
    chip.stop()
    for direction, count in list(wire.passed.items()):
        for index in range(count):
            for kind in (FEWER[index % len(FEWER)],):
                wire, other, chip = ready()
                chip.run(1)
                wire.put(Fault(direction, index, kind))
                chip.stop()
                begun = wire.now
                wire.sleep(1.0)
                assert not wire.moving(7), f"{direction} {index} {kind}"
                assert wire.true(7) < 1000 * 64 * (begun / SECOND - 1000)
                assert chip.wait(check=False).reason.name == "STOPPED"
                wire.put()
                assert chip.position() == wire.true(7) / 64
                assert other.counter() == 0


@pytest.mark.parametrize("kind", FEWER)
def test_opening_with_a_fault_at_any_character(kind: Kind) -> None:
    """Before chips echo nothing can be verified: a fault may set something then, but moves nothing and selects nobody else."""
    wire = ChipWire("B", (0, 7), statement_ns=0)
    wire.put()
    M1486(chip_line(wire), 7).open()
    for direction, count in list(wire.passed.items()):
        for index in range(FEWER.index(kind) % 2, min(count, 30), 2):
            wire = ChipWire("B", (0, 7), statement_ns=0)
            wire.put(Fault(direction, index, kind))
            chip = M1486(chip_line(wire), 7)
            try:
                chip.open()
            except (LineFailure, Refusal):
                wire.put()
                chip.open()
            chip.move_by(10.0)
            assert chip.wait(60.0).ok
            assert (wire.true(0), wire.true(7)) == (0, 640)
