"""User registers as numbers of a type. The bytes are those of the manual: the low word comes first."""

from __future__ import annotations

from collections.abc import Callable
from typing import assert_type

import pytest
from host_rig import Wire, driver

from steptwin.drivers import Mic488, NoAnswer
from steptwin.errors import Misuse


def test_views_of_the_same_registers() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.user.reals.write(100, 12.5)
    assert (wire.twin.user[100], wire.twin.user[101]) == (0x0000, 0x4148)
    mic.user.dints.write(102, -2)
    assert (wire.twin.user[102], wire.twin.user[103]) == (0xFFFE, 0xFFFF)
    mic.user.ints.write(104, -3)
    assert wire.twin.user[104] == 0xFFFD
    assert mic.user.words.read(104) == 0xFFFD
    assert (mic.user.reals.read(100), mic.user.dints.read(102), mic.user.ints.read(104)) == (12.5, -2, -3)
    assert mic.user.words.read_many(100, 5) == [0, 0x4148, 0xFFFE, 0xFFFF, 0xFFFD]


def test_numbers_have_their_type() -> None:
    """`make types` checks this: a blocking view gives what an asynchronous one does."""
    mic = driver(Wire())
    assert assert_type(mic.user.words.read(0), int) == 0
    assert assert_type(mic.user.reals.read(0), float) == 0.0
    assert assert_type(mic.user.dints.read_many(0, 1), list[int]) == [0]


def test_many_values_take_few_frames() -> None:
    wire = Wire()
    mic = driver(wire)
    wire.sent.clear()
    values = [n / 4 for n in range(100)]
    mic.user.reals.write_many(0, values)
    assert len(wire.sent) == 2
    assert mic.user.reals.read_many(0, 100) == values
    assert len(wire.sent) == 4


def test_what_no_register_holds() -> None:
    mic = driver(Wire())
    with pytest.raises(Misuse, match="permitted −32768…32767"):
        mic.user.ints.write(0, 40000)
    with pytest.raises(Misuse, match="a whole number is needed"):
        mic.user.words.write(0, 1.5)  # type: ignore[arg-type]
    with pytest.raises(Misuse, match="DINTs begin at even registers"):
        mic.user.dints.read(1)
    with pytest.raises(Misuse, match="user register 1 as WORD × 100000 is outside"):
        mic.user.words.read_many(1, 100_000)


def test_the_non_volatile_memory_is_given_three_seconds() -> None:
    """As long as a driver with this time-out waits for any coil."""

    def waited(action: Callable[[Mic488], object], timeout_s: float = 0.3) -> int:
        wire = Wire()
        mic = driver(wire, timeout_s=timeout_s)
        wire.severed = True
        begin = wire.now
        with pytest.raises(NoAnswer):
            action(mic)
        return wire.now - begin

    for action in (lambda mic: mic.user.save(), lambda mic: mic.user.load(), lambda mic: mic.user.zero()):
        assert waited(action) == waited(lambda mic: mic.axis(1).enable(), timeout_s=3.0)
        assert waited(action, timeout_s=4.0) == waited(lambda mic: mic.axis(1).enable(), timeout_s=4.0)


def test_the_non_volatile_copy() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.user.words.write(1000, 7)
    mic.user.save()
    mic.user.zero()
    assert mic.user.words.read(1000) == 0
    mic.user.load()
    assert mic.user.words.read(1000) == 7
    with pytest.raises(Misuse, match="USER_REG_SAVE"):
        driver(Wire(firmware="1.23")).user.save()


def test_what_a_driver_remembers_of_reads_is_bounded() -> None:
    """A plan and a request for each set of values that was read: 256 at most."""
    wire = Wire()
    mic = driver(wire)
    unit = mic._driver._unit
    for number in range(300):
        assert mic.user.words.read_many(number, 2) == [wire.twin.user[number], wire.twin.user[number + 1]]
        assert len(unit._plans) <= 256
        assert len(unit._queries) <= 256
    assert (len(unit._plans), len(unit._queries)) == (300 - 256, 300 - 256)
