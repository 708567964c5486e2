"""Faults of an M1486."""

from __future__ import annotations

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.encoding import encode
from steptwin.m1486.lines import DUAL_DAC
from steptwin.m1486.syntax import parse as parse_m1486
from steptwin.m1486.variants import variant
from steptwin.simulation.faults import Faults, prepare_for_faults, read
from steptwin.simulation.kinds.m1486.faults import M1486Body
from steptwin.simulation.scheduler.scheduler import Scheduler


def chip(*faults: str) -> tuple[M1486Chip, Scheduler]:
    chip = M1486Chip(variant("E1"), address=1)
    scheduler, held = Scheduler(), Faults()
    scheduler.add("1", chip)
    prepare_for_faults(scheduler, "1", held, M1486Body(chip))
    for fault in faults:
        held.add(read(fault))
    return chip, scheduler


def download(chip: M1486Chip, scheduler: Scheduler, text: str, seconds: float) -> None:
    for line in ("[", text, "]"):
        scheduler.advance(scheduler.now + SECOND)
        chip.receive(f"{line}\r".encode(), scheduler.now)
        scheduler.propagate()
    scheduler.advance(scheduler.now + round(seconds * SECOND))


def code_of(text: str) -> bytes:
    return b"".join(encode(command) for command in parse_m1486(text).program.all_commands)


def test_power_cut_while_a_chip_keeps_its_file() -> None:
    for written, has_file in ((0, False), (3, False), (10_000, True)):
        one, scheduler = chip(f"power-cut written={written}")
        download(one, scheduler, "V500", 5.0)
        assert bool(one.image) is has_file, written
        assert [event.code for event in one.events][-1] == "power-on"


def test_a_worn_eeprom_loses_a_file() -> None:
    one, scheduler = chip("wear writes=1")
    download(one, scheduler, "V500", 5.0)
    first = one.image
    assert first
    download(one, scheduler, "V600 V700", 5.0)
    assert one.image in (b"", first)


def test_a_chip_without_supply_is_deaf() -> None:
    one, scheduler = chip("supply-drop at_s=1 for_s=1")
    heard = []
    for moment in (0.2, 1.2, 2.2):
        scheduler.advance(round(moment * SECOND))
        one.receive(b"X1\rU20\r", scheduler.now)
        scheduler.propagate()
        scheduler.advance(scheduler.now + 700 * MILLISECOND)
        heard.append(b"".join(data for _, data in one.to_send(scheduler.now)))
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
    one, scheduler = chip("stuck pin=jog value=0 from_s=1", "bounce pin=b3 bounces=1 for_ms=1")
    scheduler.advance(SECOND)
    assert one.pins()["JOG"] == 0
    scheduler.controllers["1"].set_pin("JOG", 1, SECOND)
    scheduler.controllers["1"].set_pin("B3", 0, SECOND)
    scheduler.propagate()
    assert (one.pins()["JOG"], one.pins()["B3"]) == (0, 0)
    levels = set()
    while (due := scheduler.deadline()) is not None and due < 2 * SECOND:
        scheduler.advance(due)
        levels.add(one.pins()["B3"])
    assert levels == {0.0, 1.0}
    assert one.pins()["B3"] == 0
