"""A driver without an address on lines of one and of several chips: nothing moves unless it is known which one will."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from chip_rig import ChipWire, Fault, chip_driver, chip_line, typed

from steptwin.drivers.m1486 import M1486, SeveralChips
from steptwin.errors import LineFailure, Refusal

MOTIONS: dict[str, Callable[[M1486], object]] = {
    "move_to": lambda chip: chip.move_to(50.0),
    "move_by": lambda chip: chip.move_by(50.0),
    "run": lambda chip: chip.run(1),
    "seek": lambda chip: chip.seek(1, 2),
    "start_program": lambda chip: chip.start_program(1),
    "run_block": lambda chip: chip.run_block(["f640", "r"]),
    "download": lambda chip: chip.download("f640\nr"),
    "jog": lambda chip: chip.jog(50.0).__enter__(),
}


@pytest.mark.parametrize("kind", ["A", "B", "C", "E1", "E2"])
@pytest.mark.parametrize("addresses", [(15,), (1,), (7,)])
def test_the_only_chip_needs_no_address(kind: str, addresses: tuple[int, ...]) -> None:
    wire = ChipWire(kind, addresses)
    chip = chip_driver(wire)
    chip.move_by(1.0)
    assert chip.wait().ok
    assert wire.true() == 64


def test_the_only_chip_may_have_address_0_and_be_off_meanwhile() -> None:
    wire = ChipWire("B", (0,))
    chip = chip_driver(wire)
    wire.chip.power_cycle(wire.now)
    with pytest.raises(LineFailure, match="was switched off or reset"):
        chip.move_by(1.0)
    chip.move_by(1.0)
    assert chip.wait().ok
    assert wire.true() == 64


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("addresses", [(0, 7), (1, 15), (3, 4), (0, 1, 2)])
def test_without_an_address_nothing_moves_on_a_line_of_several(motion: str, addresses: tuple[int, ...]) -> None:
    """The driver was not opened either: the first command finds out."""
    wire = ChipWire("B", addresses)
    named = ", ".join(map(str, addresses)).replace("15", "F")
    with pytest.raises(SeveralChips, match=rf"several chips \({named}\) answer: .* name one, as chip=7") as refused:
        chip_driver(wire)
    assert refused.value.addresses == addresses
    chip = M1486(chip_line(wire), variant="B")
    chip._driver._unit.shared.variant = chip._driver._variant
    with pytest.raises(SeveralChips):
        MOTIONS[motion](chip)
    wire.sleep(1.0)
    assert [wire.true(address) for address in addresses] == [0] * len(addresses)
    assert "moves" not in wire.codes()
    alone = M1486(chip_line(wire), addresses[-1])
    alone.open()
    alone.move_by(1.0)
    assert alone.wait().ok
    assert [wire.true(address) for address in addresses] == [0] * (len(addresses) - 1) + [64]


@pytest.mark.parametrize("kinds", [("E1", (1, 15)), ("A", (0, 15)), ("E2", (1, 2, 3))])
def test_chips_of_each_memory_are_counted(kinds: tuple[str, tuple[int, ...]]) -> None:
    with pytest.raises(SeveralChips):
        chip_driver(ChipWire(*kinds))


def test_a_chip_that_does_not_echo_is_counted_by_its_letter() -> None:
    """Another program has left only one of them with its echo on."""
    wire = ChipWire("B", (3, 7))
    M1486(chip_line(wire), 7).open()
    wire.chips[3].unit.functions[41 - 40] = False
    with pytest.raises(SeveralChips, match="several chips answer"):
        chip_driver(wire)


def test_only_the_chip_that_was_found_hears_what_is_sent() -> None:
    """One that moves by its own program and does not echo cannot be counted: it is not selected."""
    wire = ChipWire("B", (3, 7))
    busy = M1486(chip_line(wire), 3)
    busy.open()
    busy.run(1)
    wire.chips[3].unit.functions[41 - 40] = False
    chip = chip_driver(wire)
    chip.move_by(10.0)
    assert chip.wait().ok
    assert wire.true(7) == 640
    assert wire.moving(3)


@pytest.mark.parametrize(("kind", "index_of_first"), [("drop", 0), ("flip 0", 3), ("insert", 5)])
def test_a_fault_in_the_count_never_moves_two(kind: str, index_of_first: int) -> None:
    for direction, count in (("to chip", 120), ("to host", 20)):
        for index in range(index_of_first, count, 7):
            wire = ChipWire("B", (0, 7), statement_ns=0)
            wire.put(Fault(direction, index, kind))  # type: ignore[arg-type]
            chip = M1486(chip_line(wire))
            try:
                chip.open()
                chip.move_by(10.0)
            except (LineFailure, Refusal):
                pass
            wire.sleep(1.0)
            assert (wire.true(0), wire.true(7)) == (0, 0), f"{direction} {index} {typed(wire)}"
