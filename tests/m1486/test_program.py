"""Program flow: loops, jumps, subroutines, the time of commands, holding, hooks."""

from __future__ import annotations

from typing import Any

import pytest
from held import held
from m1486_rig import Bench, seconds

from steptwin.controller import MILLISECOND
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.encoding import decode
from steptwin.m1486.program import BURST, BURST_NS
from steptwin.m1486.variants import variant


def sends(*lines: str, kind: str = "B", **options: Any) -> bytes:
    bench = Bench(kind, **options)
    return bench.file(*lines) + bench.finish()


# ---------------------------------------------------------------------- flow


def test_loop_repeats_what_stands_between() -> None:
    assert sends("l3", "u20", "e", "u15") == b"\x42\x42\x42\x02"
    assert sends("l1", "u20", "e", "u15") == b"\x42\x02"
    assert len(sends("l255", "u20", "e")) == 255


def test_m_5_loops_stand_inside_one_another_up_to_four_levels() -> None:
    assert len(sends("l2", "l3", "l2", "l2", "u20", "e", "e", "e", "e")) == 24
    bench = Bench()
    bench.file(*["l2"] * 5, "u20", *["e"] * 5)
    assert bench.finish() == b""
    assert "more than 4 loops" in bench.wrong[0]


def test_m_35_a_loop_that_a_jump_has_left_begins_anew() -> None:
    bench = Bench()
    bench.file("@1", "l3", "i2h2", "e", "@2", "u20", "w5", "j1")  # B2 is high: no pass is finished
    assert bench.run(ms=200) == b"\x42" * 23
    assert bench.wrong == []
    # One pass that is left, then three; the loop inside is over when the outer one begins anew.
    assert sends("@1", "l3", "u15", "i80l2", "e", "u20", "j3", "@2", "t80", "j1", "@3") == b"\x02" * 4 + b"\x42"
    bench = Bench()
    bench.file("@1", "l3", "l2", "i80l2", "e", "u15", "e", "u20", "j3", "@2", "t80", "j1", "@3")
    assert bench.finish() == b"\x02" * 3 + b"\x42"
    assert bench.chip.program.loop_counts == []


def test_a_loop_begun_outside_the_brackets_ends_inside() -> None:
    # As in example 6 of the manual.
    bench = Bench()
    assert bench.do("l3", "[", "u20", "e", "u15", "]") == b"\x42\x42\x42\x02"


def test_m_20_end_of_loop_alone_and_dot_outside_a_subroutine_are_wrong_data() -> None:
    for command in ("e", "."):
        bench = Bench()
        bench.file(command, "u20")
        assert bench.finish() == b""
        assert len(bench.wrong) == 1


def test_jump_and_subroutine() -> None:
    assert sends("j2", "u20", "@2", "u15") == b"\x02"
    assert sends("'3", "u15", "'3", "j1", "@3", "u20", ".", "@1") == b"\x42\x02\x42"


def test_a_subroutine_inside_a_subroutine_is_wrong_data() -> None:
    bench = Bench()
    assert bench.file("'1", "u15", "@1", "'2", "@2", "u20", ".") + bench.finish() == b""
    assert "subroutine inside a subroutine" in bench.wrong[0]


def test_m_17_a_jump_to_a_missing_label_is_wrong_data() -> None:
    for command in ("j5", "'5", "i80l5"):
        bench = Bench()
        bench.file(command, "u20")
        assert bench.finish() == b""
        assert bench.wrong == ["wrong data: there is no label 5; the program stops"]
    # A condition that does not hold asks for no label.
    assert sends("i80h5", "u20") == b"\x42"


def test_the_later_of_two_labels_counts() -> None:
    assert sends("j1", "@1", "u20", "j2", "@1", "u15", "@2") == b"\x02"


def test_a_label_given_anew_counts_for_commands_that_were_done_before() -> None:
    def next_round(bench: Bench) -> bytes:
        bench.pin(B3=0)
        answer = bench.run(ms=5)
        bench.pin(B3=1)
        return answer + bench.run(ms=5)

    for condition in ("j1", "i80l1"):
        bench = Bench()
        bench.file("@1", "u20", "z3", "o3", condition)
        bench.run(ms=5)
        assert next_round(bench) == b"\x42"
        bench.send("@1", "u15")
        assert next_round(bench) == b"\x02"


def test_commands_that_are_overwritten_in_the_ring_leave_nothing_behind() -> None:
    """A command that names a label is compiled again wherever the ring has brought it."""
    chip = M1486Chip(variant("B"), statement_ns=0)

    def level(commands: int) -> int:
        for _ in range(commands):
            chip.receive(b"i80h1\r", chip.now + MILLISECOND)
        return held(chip).bytes

    assert level(2000) == level(4000)


def test_the_internal_variable_stands_for_a_number_left_out() -> None:
    assert sends(":2", "j", "@1", "u20", "@2", "u15") == b"\x02"
    assert sends(":3", "l", "u20", "e") == b"\x42" * 3
    bench = Bench()
    bench.file(":0", "l", "u20", "e")
    assert bench.finish() == b""
    assert "L0 is out of range" in bench.wrong[0]


# ---------------------------------------------------------------------- time


def test_m_19_a_command_takes_a_millisecond_or_half_of_it_at_24_mhz() -> None:
    for kind, each in (("B", 1.0), ("B2x", 0.5)):
        bench = Bench(kind)
        bench.file(":5", *["u4"] * 10)
        bench.finish()
        assert seconds(bench.events("upload")) == pytest.approx([each * n / 1000 for n in range(1, 11)])


def test_m_19_the_time_of_a_command_can_be_chosen() -> None:
    bench = Bench(statement_ns=250_000)
    bench.file(*["u4"] * 3)
    bench.finish()
    assert [event.time for event in bench.events("upload")] == [0, 250_000, 500_000]


def test_m_19_wrong_data_take_the_time_of_a_command_each_time() -> None:
    bench = Bench()
    bench.do("t44")
    begun = bench.now
    bench.file("@1", "u4", "j5", "j1")
    bench.run(ms=12)
    assert [event.time - begun for event in bench.events("upload")] == [3 * n * MILLISECOND for n in range(5)]


def test_m_19_without_time_many_commands_happen_at_once_and_an_endless_loop_lets_time_go_on() -> None:
    bench = Bench(statement_ns=0)
    bench.file(":0", "@1", "+1", "j1")
    assert bench.now == 0
    assert bench.variable == (BURST - 1 + 1) // 2
    bench.chip.advance(BURST_NS - 1)
    assert bench.variable == BURST // 2
    bench.chip.advance(10 * BURST_NS)
    assert bench.variable == 11 * BURST // 2


def test_m_19_without_time_a_loop_that_acts_lets_time_go_on_too() -> None:
    bench = Bench(statement_ns=0)
    assert len(bench.file("@1", "u20", "j1")) == BURST // 2
    assert len(bench.run(ms=1)) == BURST // 2


@pytest.mark.parametrize(("kind", "ms"), [("B", 3000), ("B2x", 1500)])
def test_wait_waits(kind: str, ms: int) -> None:
    bench = Bench(kind)
    bench.file("w3000", "u20")
    assert bench.run(ms=ms - 0.001) == b""
    assert bench.run(ms=0.001) == b"\x42"


def test_the_longest_wait() -> None:
    bench = Bench()
    bench.file("w16000000", "u20")
    assert bench.run(15_999.999) == b""
    assert bench.run(0.001) == b"\x42"


def test_a_program_waits_for_lines() -> None:
    bench = Bench()
    bench.file("z3", "u20", "o3", "u15", "o3", "u4")
    assert bench.run(10.0) == b""
    assert bench.chip.deadline() is None
    bench.pin(B3=0)
    assert bench.sent() == b"\x42"
    assert bench.run(10.0) == b""
    bench.pin(B3=1)
    assert bench.sent() == b"\x02"
    assert bench.run(ms=2) == b"\x00"


@pytest.mark.parametrize(("low_after_ms", "sends_at_ms"), [(100.5, 100.5), (0.25, 1.0)])
def test_m_42_waiting_for_a_line_takes_no_time_beyond_that_of_the_command(low_after_ms: float, sends_at_ms: float) -> None:
    bench = Bench()
    bench.file("z3", "u20")
    bench.run(ms=low_after_ms)
    bench.pin(B3=0)
    bench.finish()
    assert [event.time / MILLISECOND for event in bench.events("upload")] == [sends_at_ms]


def test_a_line_that_has_the_level_already_is_not_waited_for() -> None:
    assert sends("o3", "u20") == b"\x42"


# ---------------------------------------------------------------------- holding


def test_kill_leaves_the_program_going_while_function_51_is_on() -> None:
    bench = Bench()
    bench.file("f640000", "r", "u20")
    bench.run(0.2)
    bench.send("k")
    assert bench.finish() == b"\x42"


def test_kill_holds_the_program_while_function_51_is_off_and_clear_kill_lets_it_go_on() -> None:
    bench = Bench()
    bench.file("c51", "f640000", "r", "u20")
    bench.run(0.2)
    bench.send("k")
    assert bench.run(20.0) == b""
    assert not bench.chip.drive.is_busy
    assert bench.send("c75") == b"\x42"


def test_kill_at_rest_holds_the_program_too() -> None:
    bench = Bench()
    bench.file("c51", "w100", "u20")
    bench.run(ms=10)
    bench.send("k")
    assert bench.run(1.0) == b""
    assert bench.send("c75") == b"\x42"


def test_commands_received_while_the_program_is_held_wait() -> None:
    bench = Bench()
    bench.do("c51")
    bench.send("k", "u20")
    assert bench.run(1.0) == b""
    assert bench.send("c75") == b"\x42"


def test_a_reset_ends_holding() -> None:
    bench = Bench()
    bench.do("c51")
    assert bench.send("k", "u20", "\\", "u15") == b"\x02"


# ---------------------------------------------------------------------- hooks


def test_a_hook_is_called_before_every_command_and_changes_nothing() -> None:
    lines = (":58", "l3", "+2", "i87h1", "e", "@1", "u4", "f", "w5")
    plain = Bench()
    plain.file(*lines)
    plain.finish()
    watched = Bench()
    chip, called = watched.chip, list[tuple[int, str]]()

    def hook(now: int, place: int) -> None:
        found = decode(chip.memory.fetch(place))
        called.append((now, "" if found is None else str(found.command)))

    chip.program.add_hook(hook)
    watched.file(*lines)
    watched.finish()
    assert [command for _, command in called] == [":58", "L3", *["+2", "I87H1", "E"] * 3, "U4", "F", "W5"]
    assert [now for now, _ in called] == [n * MILLISECOND for n in range(len(called))]
    assert chip.events == plain.chip.events
    chip.program.remove_hook(hook)
    assert chip.snapshot().state == plain.chip.snapshot().state


def test_several_hooks_are_called_in_their_order_until_they_are_taken_away() -> None:
    bench = Bench()
    called: list[str] = []

    def first(_now: int, place: int) -> None:
        called.append(f"first {place}")

    def second(_now: int, place: int) -> None:
        called.append(f"second {place}")

    bench.chip.program.add_hook(first)
    bench.chip.program.add_hook(second)
    bench.file("+1")
    bench.finish()
    bench.chip.program.remove_hook(first)
    bench.send("+1")
    bench.finish()
    assert [name.split()[0] for name in called] == ["first", "second", "second"]
