"""Every command on every variant: what a chip takes, what it refuses, and where the command then lies in its memory."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from m1486_rig import Bench

from steptwin.controller import MILLISECOND
from steptwin.m1486.commands import TABLE, ArgType, CommandSpec, When, find, memory_bits, takes_variable
from steptwin.m1486.commanduse import Control, Wait
from steptwin.m1486.encoding import decode
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.m1486.variants import VARIANTS, Variant

QUEUED = [spec for spec in TABLE if spec.when is When.QUEUED]

every_variant = pytest.mark.parametrize("v", VARIANTS, ids=lambda v: v.name)


def taken(spec: CommandSpec, v: Variant) -> Iterator[ChipCommand]:
    """A row's command with its least and largest number, and without one."""
    if spec.kind is ArgType.NONE:
        yield ChipCommand(spec.key)
        return
    values = spec.permitted(v)
    for number in (values[0], values[-1]):
        yield ChipCommand(spec.key, JumpCondition(number, True, v.labels) if spec.kind is ArgType.CONDITION else number)
    if takes_variable(spec.key):
        yield ChipCommand(spec.key)


def refused(spec: CommandSpec, v: Variant) -> Iterator[str]:
    """The same with the numbers next to the permitted ones, and with a number too many."""
    if spec.kind is ArgType.NONE:
        yield f"{spec.key}1" if len(spec.key) == 1 and find(spec.key, 1, v) is None else f"{spec.key}x"
        return
    values = spec.permitted(v)
    for number in (values[0] - 1, values[-1] + 1):
        if number >= 0 and find(spec.key, number, v) is None:
            yield f"{spec.key}{number}" + ("h1" if spec.kind is ArgType.CONDITION else "")
    if spec.kind is ArgType.CONDITION:
        yield from (f"I1L{v.labels + 1}", "I1L0", "I1X1", "I1H")


@every_variant
def test_a_permitted_command_takes_its_bits_of_the_memory(v: Variant) -> None:
    for spec in QUEUED:
        for command in taken(spec, v):
            bench = Bench(v.name)
            bench.send("[", str(command).lower())
            memory = bench.chip.memory
            assert (command, bench.wrong) == (command, [])
            assert (command, 8 * memory.write) == (command, memory_bits(spec.key))
            assert decode(memory.fetch(0)) == (command, memory.write)


@every_variant
def test_a_command_out_of_range_is_dropped_and_named(v: Variant) -> None:
    for text in [text for spec in QUEUED for text in refused(spec, v)]:
        bench = Bench(v.name)
        bench.send("[", text)
        assert (text, len(bench.wrong)) == (text, 1)
        assert (text, bench.chip.memory.write) == (text, 0)


@every_variant
def test_the_internal_variable_out_of_range_is_wrong_data_when_the_command_is_done(v: Variant) -> None:
    for spec in QUEUED:
        values = spec.permitted(v) if takes_variable(spec.key) else ()
        for number in (values[0] - 1, values[-1] + 1) if values else ():
            if not 0 <= number < 2**24 or find(spec.key, number, v) is not None:
                continue
            bench = Bench(v.name)
            bench.do(f":{number}", spec.key)
            assert len(bench.wrong) == 1
            assert f"{spec.key}{number} is out of range" in bench.wrong[0]


@every_variant
def test_m_19_a_command_takes_its_time(v: Variant) -> None:
    # Those that wait, move, jump, or are wrong data when they stand alone have tests of their own.
    each = MILLISECOND // v.clock
    for spec in QUEUED:
        if spec.use.waits is not Wait.NOTHING or spec.use.control is not Control.NEXT:
            continue
        command = ChipCommand(spec.key, 64) if spec.unit == "min. microsteps" else next(taken(spec, v))
        bench = Bench(v.name)
        bench.send("[", str(command), "u20", "]")
        bench.finish()
        assert (command, [event.time for event in bench.events("upload")]) == (command, [2 * v.write_ns + each])


def test_clear_kill_out_of_the_internal_variable_does_nothing() -> None:
    """C75 acts when it is received; a program that comes to it was not stopped."""
    bench = Bench()
    bench.file(":75", "c", "u4")
    assert bench.finish() == b"\x4b"
    assert (bench.wrong, bench.events("clear-kill")) == ([], [])
