"""Programs in the ring of the command memory (M-12): which labels can be started, and when a program is overwritten."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from chip_rig import KNOWN, ChipWire, chip_driver, chip_line

from steptwin.controller import SECOND
from steptwin.drivers.m1486 import M1486, ChipReason, ProgramLost
from steptwin.drivers.m1486.driver import START_BITS
from steptwin.errors import Misuse
from steptwin.m1486.commands import memory_bits
from steptwin.m1486.variants import variant

ENDLESS = "[\nJ6\n@5\nF640\nR\nW500\nJ5\n@6\n]"
ENDS: dict[str, tuple[str, bool]] = {
    # A program, and whether its end can be reached from label 5.
    "falls off": ("[\nW1\nJ6\n@5\nF6400\nR\nW100\n@6\n]", True),
    "jumps to the end": ("[\nJ6\n@5\nF64\nR\nJ6\n@6\n]", True),
    "may jump to the end": ("[\nJ6\n@5\nF64\nR\nI1L6\nJ5\n@6\n]", True),
    "its loop has an end": ("[\nJ6\n@5\nL3\nF64\nR\nE\n@6\n]", True),
    "its subroutine returns to the end": ("[\nJ6\n@7\nF64\nR\n.\n@5\n'7\n@6\n]", True),
    "plain commands": ("J6\n@5\nF64\nR\n@6".removeprefix("J6\n"), True),
    "repeats": (ENDLESS, False),
    "repeats a subroutine": ("[\nJ6\n@7\nF64\nR\n.\n@5\n'7\nJ5\n@6\n]", False),
    "waits at its end": ("[\nJ6\n@5\nF64\nR\n@9\nW1000\nJ9\n@6\n]", False),
}


@pytest.mark.parametrize("case", ENDS)
def test_a_label_is_started_unless_the_end_can_be_reached(case: str) -> None:
    text, has_end = ENDS[case]
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.download(text)
    chip.wait()
    wire.happened.clear()
    if not has_end:
        chip.start_program(5)
        wire.sleep(2.0)
        assert "moves" in wire.codes()
        return
    with pytest.raises(Misuse, match=r"label 5: the end of the program can be reached .* such as @9 W1000 J9, or run it once"):
        chip.start_program(5)
    wire.sleep(2.0)
    assert "moves" not in wire.codes()


READS: dict[str, Callable[[M1486], object]] = {
    "status": lambda chip: chip.status(),
    "counter": lambda chip: chip.counter(),
    "functions": lambda chip: chip.functions(),
    "is_busy": lambda chip: chip.is_busy(),
    "another driver": lambda chip: M1486(chip._driver.line).open(),  # type: ignore[arg-type]
    "configure": lambda chip: chip.configure(velocity=500),
}


@pytest.mark.parametrize("kind", ["A", "B", "C", "E1"])
@pytest.mark.parametrize("what", READS)
def test_a_program_is_started_as_long_as_it_is_there_and_no_longer(kind: str, what: str) -> None:
    """Whatever is sent takes its place in the ring, and is counted."""
    wire = ChipWire(kind)
    chip = chip_driver(wire)
    filling = "\n".join(["F640"] * (variant(kind).memory_bits // 32 - 13))
    chip.download(f"[\nJ6\n@5\nF640\nR\nW500\nJ5\n{filling}\n@6\n]")
    chip.wait(60.0)
    starts = 0
    while spare_bits(wire) >= memory_bits("U") + START_BITS:
        starts += 1
        chip.start_program(5)
        assert not wire.chip.program.is_at_end
        chip.stop_program()
        READS[what](chip)
    assert 0 < starts < 12
    with pytest.raises(ProgramLost, match="label 5 is not started: "):
        chip.start_program(5)
    assert wire.chip.program.is_at_end


def spare_bits(wire: ChipWire) -> int:
    """What the chip may still store before label 5 is overwritten."""
    memory = wire.chip.memory
    return 8 * (memory.size - memory.age(memory.labels[5])) if 5 in memory.labels else -1


@pytest.mark.parametrize("is_timed", [True, False])
def test_a_program_that_another_process_has_downloaded_is_looked_for_behind_j(is_timed: bool) -> None:
    """Nothing is known of it: so it counts what the chip does. Where characters take no time, a question sent at once is
    dropped with the wrong data."""
    wire = ChipWire("B", is_timed=is_timed)
    first = chip_driver(wire)
    first.download(ENDLESS)
    first.wait()
    second = chip_driver(wire)
    second.start_program(5)
    wire.sleep(1.0)
    assert second.is_busy()
    second.stop_program()
    for _ in range(10):
        second.counter()
        second.variable()
    third = chip_driver(wire)
    with pytest.raises(ProgramLost, match="the chip is at rest: it has no label 5"):
        third.start_program(5)
    assert third.wait().reason is ChipReason.REST


def test_a_program_without_end_that_comes_to_rest_was_ended() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.download(ENDLESS)
    chip.wait()
    chip.start_program(5)
    wire.sleep(1.0)
    wire.chain.receive(b"%\r", wire.now)
    wire.sleep(3.0)
    end = chip.wait(20.0, check=False)
    assert (end.ok, end.reason) == (False, ChipReason.CUT)


def test_the_end_of_a_program_that_is_not_known_is_not_taken_for_the_end_of_the_motion() -> None:
    wire = ChipWire("B")
    first = chip_driver(wire)
    first.configure(**KNOWN)
    first.download("[\nW1\nJ6\n@5\nF64000\nR\nW500\n@6\n]")
    first.wait()
    second = chip_driver(wire)
    second.start_program(5)
    end = second.wait(30.0, check=False)
    assert (end.ok, end.detail) == (False, "its end leads to the J behind it, and to label 5 again")
    second.stop_program()
    wire.sleep(2.0)
    assert not wire.moving()


@pytest.mark.parametrize("kind", ["A", "B", "C"])
def test_what_opening_and_status_store(kind: str) -> None:
    """16 bits for each question; nothing else for a chip that echoes already."""
    wire = ChipWire(kind, (7,))

    def stored(call: Callable[[], object]) -> int:
        before = wire.chip.memory.write
        call()
        return 8 * ((wire.chip.memory.write - before) % wire.chip.memory.span)

    chip = M1486(chip_line(wire), 7)
    assert stored(chip.open) == 16 + 4 * 16
    assert stored(M1486(chip_line(wire), 7).open) == 4 * 16
    assert stored(M1486(chip_line(wire)).open) == 5 * 16
    assert stored(chip.status) == stored(chip.is_busy) == 16
    assert chip._driver._unit.stored_bits == 16 + 4 * 16 + 2 * 16


def test_a_reset_or_another_download_replaces_a_program() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.download(ENDLESS)
    chip.wait()
    chip.reset()
    with pytest.raises(ProgramLost, match="is at rest: it has no label 5"):
        chip.start_program(5)
    chip.download("[\nJ6\n@5\nF64\nR\n@6\n]")
    chip.wait()
    chip.download(ENDLESS)
    chip.wait()
    chip.start_program(5)
    begin = wire.now
    wire.sleep(3.0)
    assert wire.codes().count("moves") > 3
    assert wire.now - begin < 4 * SECOND
