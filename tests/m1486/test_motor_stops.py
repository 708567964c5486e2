"""What ends a motion before its end: K, LIMIT, and lines that are sought (manual chapters VI, VII.2)."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m1486_rig import Bench, moving, speed

from steptwin.controller import SECOND
from steptwin.m1486.lines import SEEK_ENDS_LOW, TWO_DACS

STEP = 64


# ---------------------------------------------------------------------- K


def test_kill_brakes_with_the_slope_of_the_acceleration_to_a_full_step() -> None:
    bench = moving("m64", "v1000", "f640000", seconds=1.0)
    bench.send("k")
    killed = bench.now
    bench.finish()
    stopped = bench.events("stands")[0].time
    # 800 step/s at 5000 step/s², then at 200 step/s on to the next full step.
    assert 0.16 <= (stopped - killed) / SECOND <= 0.16 + 1 / 200
    assert bench.true % STEP == 0
    assert bench.true == bench.sum_of_pulses()


def test_kill_without_function_50_ends_where_the_ramp_ends() -> None:
    bench = moving("c50", "m8", "v1000", "f640000", seconds=1.0003)
    bench.send("k")
    killed = bench.now
    bench.finish()
    # At most one microstep more, at 200 step/s.
    assert 0.16 - 1e-9 <= (bench.events("stands")[0].time - killed) / SECOND <= 0.16 + 1 / 200 / 8
    assert bench.true % STEP != 0
    assert bench.true == bench.sum_of_pulses()


def test_kill_at_start_stop_speed_stops_at_once() -> None:
    bench = moving("c50", "v150", "f640000")
    bench.send("k")
    assert bench.events("stands")[0].time == bench.now


def test_m_16_the_counter_of_a_killed_move_shows_its_target_and_is_not_valid() -> None:
    bench = moving("v1000", "f640000", seconds=1.0)
    bench.send("k")
    bench.finish()
    assert bench.counter == 640_000
    assert not bench.chip.drive.is_valid
    assert 0 < bench.true < 640_000
    assert "position not valid" in bench.events("stands")[0].text
    # The next moves count from there; a position that is given makes it valid again.
    true = bench.true
    bench.do("b64000", "r")
    assert (bench.counter, bench.true, bench.chip.drive.is_valid) == (576_000, true - 64_000, False)
    bench.do("=64")
    assert (bench.counter, bench.chip.drive.is_valid) == (64, True)


def test_the_counter_of_a_killed_endless_move_is_valid() -> None:
    bench = moving("=6400000", "g-", seconds=1.0)
    bench.send("k")
    bench.finish()
    assert bench.chip.drive.is_valid
    assert bench.counter == 6_400_000 + bench.true
    assert bench.true < -6400


def test_kill_while_braking_changes_nothing() -> None:
    bench = moving("v1000", "f640000", seconds=1.0)
    bench.send("k")
    train = bench.chip.drive.train
    bench.run(ms=20)
    bench.send("k")
    assert bench.chip.drive.train is train
    assert len(bench.events("stops")) == 1


@settings(max_examples=25)
@given(st.floats(0, 1.5), st.sampled_from([(1, 1), (64, 1), (64, 4), (8, 2), (4, 1)]), st.booleans(), st.booleans())
def test_a_kill_at_any_moment_loses_no_pulse(moment: float, mq: tuple[int, int], full: bool, forward: bool) -> None:
    bench = Bench(statement_ns=0)
    bench.do(f"m{mq[0]}", f"q{mq[1]}", "v4000", "a9000", "p2000", "T50" if full else "C50", "f160000" if forward else "b160000")
    bench.send("r")
    bench.run(moment)
    bench.send("k")
    bench.finish()
    assert bench.true == bench.sum_of_pulses()
    assert abs(bench.true) <= 160_000
    assert bench.true % (STEP if full else STEP // mq[0]) == 0


# ---------------------------------------------------------------------- LIMIT


def test_limit_brakes_like_kill_and_the_program_goes_on() -> None:
    bench = moving("v1000", "f640000", seconds=1.0)
    bench.pin(LIMIT=0)
    bench.send("u20")
    assert bench.finish() == b"\x42"
    assert bench.true < 640_000
    assert not bench.chip.drive.is_valid


def test_limit_without_function_51_holds_the_program_until_it_is_high() -> None:
    bench = Bench()
    bench.file("c51", "g+", "r", "u20")
    bench.run(0.5)
    bench.pin(LIMIT=0)
    assert bench.run(5.0) == b""
    assert not bench.chip.drive.is_busy
    assert bench.send("c75") == b""
    bench.pin(LIMIT=1)
    assert bench.finish() == b"\x42"


def test_limit_is_a_level_or_an_edge() -> None:
    for edge in (False, True):
        bench = Bench()
        bench.do("t43" if edge else "c43")
        bench.pin(LIMIT=0)
        bench.do("f6400", "r")
        assert bench.true == (6400 if edge else 0)
    bench = moving("t43", "f640000", seconds=0.5)
    bench.pin(LIMIT=0)
    assert bench.chip.drive.is_stopping


def test_function_42_disables_limit() -> None:
    bench = moving("t42", "f64000")
    bench.pin(LIMIT=0)
    bench.finish()
    assert bench.true == 64_000


# ---------------------------------------------------------------------- seek


@pytest.mark.parametrize("line", range(1, 22))
def test_a_seek_ends_with_the_level_of_its_line(line: int) -> None:
    assert (line in SEEK_ENDS_LOW) is (line in {1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19})
    end = 0 if line in SEEK_ENDS_LOW else 1
    for command, sign in ((")", 1), ("(", -1)):
        bench = Bench()
        bench.pin(**{f"B{line}": 1 - end})
        bench.do("c52", "s100")
        bench.send(f"{command}{line}")
        bench.run(1.0)
        assert speed(bench) == sign * 100
        bench.pin(**{f"B{line}": end})
        assert bench.events("stands")[0].time == bench.now
        assert bench.true == sign * 100 * STEP
        assert bench.counter == bench.true % 2**24
        assert bench.chip.drive.is_valid


def test_only_the_level_of_its_own_line_ends_a_seek() -> None:
    bench = Bench()
    bench.pin(B7=0, B6=0)
    bench.do("c52")
    bench.send(")7")
    bench.run(0.1)
    for level in (1, 0):
        bench.pin(B6=level)
        bench.run(0.1)
        assert bench.events("stands") == []
    bench.pin(B7=1)
    assert len(bench.events("stands")) == 1


def test_function_52_ends_a_seek_on_four_full_steps() -> None:
    bench = Bench(interface=TWO_DACS)
    bench.do("s100")
    bench.send("(2")
    bench.run(0.333)
    bench.pin(B2=0)
    assert bench.chip.drive.is_busy
    bench.finish()
    assert bench.true % (4 * STEP) == 0
    assert -36 * STEP <= bench.true <= -33 * STEP
    assert bench.true == bench.sum_of_pulses()


def test_a_seek_whose_line_has_its_level_goes_nowhere() -> None:
    bench = Bench()
    assert bench.do(")7", "u20") == b"\x42"
    assert bench.events("seeks") == []


def test_a_seek_can_be_killed_and_limited() -> None:
    for stop in ("k", "limit"):
        bench = Bench()
        bench.pin(B7=0)
        bench.send(")7")
        bench.run(0.5)
        if stop == "k":
            bench.send("k")
        else:
            bench.pin(LIMIT=0)
        bench.finish()
        assert not bench.chip.drive.is_busy
        assert bench.chip.drive.is_valid
        assert bench.true == bench.sum_of_pulses() > 0
