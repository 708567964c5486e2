"""Faults of an M1486."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.encoding import encode
from steptwin.m1486.lines import DUAL_DAC
from steptwin.m1486.syntax import parse as parse_m1486
from steptwin.m1486.variants import variant
from steptwin.machine import MILLISECOND, SECOND
from steptwin.simulation.faults import Faults, read, rig
from steptwin.simulation.kinds.m1486.faults import M1486Body
from steptwin.simulation.scheduler.kernel import Kernel


def chip(*faults: str) -> tuple[M1486Chip, Kernel]:
    chip = M1486Chip(variant("E1"), address=1)
    kernel, held = Kernel(), Faults()
    kernel.add("1", chip)
    rig(kernel, "1", held, M1486Body(chip))
    for fault in faults:
        held.add(read(fault))
    return chip, kernel


def download(chip: M1486Chip, kernel: Kernel, text: str, seconds: float) -> None:
    for line in ("[", text, "]"):
        kernel.advance(kernel.now + SECOND)
        chip.receive(f"{line}\r".encode(), kernel.now)
        kernel.settle()
    kernel.advance(kernel.now + round(seconds * SECOND))


def code_of(text: str) -> bytes:
    return b"".join(encode(command) for command in parse_m1486(text).program.all_commands)


def test_power_cut_while_a_chip_keeps_its_file() -> None:
    for written, has_file in ((0, False), (3, False), (10_000, True)):
        one, kernel = chip(f"power-cut written={written}")
        download(one, kernel, "V500", 5.0)
        assert bool(one.image) is has_file, written
        assert [event.code for event in one.events][-1] == "power-on"


def test_a_worn_eeprom_loses_a_file() -> None:
    one, kernel = chip("wear writes=1")
    download(one, kernel, "V500", 5.0)
    first = one.image
    assert first
    download(one, kernel, "V600 V700", 5.0)
    assert one.image in (b"", first)


def test_a_chip_without_supply_is_deaf() -> None:
    one, kernel = chip("supply-drop at_s=1 for_s=1")
    heard = []
    for moment in (0.2, 1.2, 2.2):
        kernel.advance(round(moment * SECOND))
        one.receive(b"X1\rU20\r", kernel.now)
        kernel.settle()
        kernel.advance(kernel.now + 700 * MILLISECOND)
        heard.append(b"".join(data for _, data in one.to_send(kernel.now)))
    assert [bool(data) for data in heard] == [True, False, True]


def test_a_stuck_pin_of_a_chip_is_low_or_high() -> None:
    body = M1486Body(M1486Chip(variant("E1"), address=1, interface=DUAL_DAC))
    for level in (0.0, 1.0):
        body.check_pin("jog", level)
    with pytest.raises(Misuse, match=r"^jog = 0.5: a digital input is 0 or 1$"):
        body.check_pin("jog", 0.5)
    with pytest.raises(Misuse, match="B10"):
        body.check_pin("b10", 0.0)  # a line of the driver interface


def test_stuck_and_bouncing_pins_of_a_chip_by_either_name() -> None:
    one, kernel = chip("stuck pin=jog value=0 from_s=1", "bounce pin=b3 bounces=1 for_ms=1")
    kernel.advance(SECOND)
    assert one.pins()["JOG"] == 0
    kernel.machines["1"].set_pin("JOG", 1, SECOND)
    kernel.machines["1"].set_pin("B3", 0, SECOND)
    kernel.settle()
    assert (one.pins()["JOG"], one.pins()["B3"]) == (0, 0)
    levels = set()
    while (due := kernel.deadline()) is not None and due < 2 * SECOND:
        kernel.advance(due)
        levels.add(one.pins()["B3"])
    assert levels == {0.0, 1.0}
    assert one.pins()["B3"] == 0
