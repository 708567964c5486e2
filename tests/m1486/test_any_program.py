"""Any program that the language permits can be run: nothing raises, and the motor stands where its pulses led."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m1486_rig import Bench

from steptwin.controller import SECOND
from steptwin.m1486.commands import When, memory_bits, when
from steptwin.m1486.lines import INTERFACES
from steptwin.m1486.syntax import format_program
from steptwin.m1486.variants import Variant, variant

if TYPE_CHECKING:
    from m1486_programs import Programs

pins = st.tuples(st.sampled_from([f"B{n}" for n in range(1, 22)] + ["LIMIT", "JOG"]), st.integers(0, 1))
happenings = st.lists(st.tuples(st.floats(0, 3), pins | st.sampled_from(["k", "c75"])), max_size=12)


@pytest.mark.parametrize("v", [variant("A"), variant("B2x"), variant("E2")], ids=lambda v: v.name)
@settings(max_examples=50)
@given(data=st.data())
def test_any_program_runs_and_every_pulse_counts(v: Variant, permitted_programs: Programs, data: st.DataObject) -> None:
    program = data.draw(permitted_programs(v))
    interface = data.draw(st.sampled_from(INTERFACES))
    statement_ns = data.draw(st.sampled_from([None, 0, 10_000]))
    in_file = data.draw(st.booleans())
    happens = sorted(data.draw(happenings), key=lambda happening: happening[0])
    text = format_program(program, "\r")

    bench = Bench(v.name, interface=interface, statement_ns=statement_ns)
    # Wrong data are dropped, and the program goes on.
    bench.do("t44")
    bench.raw((f"[\r{text}]\r" if in_file else text).encode(errors="replace"))
    for moment, what in happens:
        bench.chip.advance(max(bench.now, round(moment * SECOND)))
        if isinstance(what, str):
            bench.send(what)
        else:
            bench.pin(**{what[0]: what[1]})
        due = bench.chip.deadline()
        assert due is None or due > bench.now
    bench.run(2.0)
    assert bench.true == bench.sum_of_pulses()
    assert 0 <= bench.counter < 2**24
    assert 0 <= bench.variable < 2**24


@given(data=st.data())
def test_a_file_takes_the_memory_that_its_commands_add_up_to(permitted_programs: Programs, data: st.DataObject) -> None:
    program = data.draw(permitted_programs(variant("B")))
    commands = [c for c in program.commands if c.key not in ("\\", "]", "K", "X", "XG")]
    bench = Bench("B")
    bench.send("[", *(str(command) for command in commands))
    stored = [command for command in commands if when(command.key, command.number) is When.QUEUED]
    assert 8 * bench.chip.memory.write == sum(memory_bits(command.key) for command in stored)
    assert bench.wrong == []
