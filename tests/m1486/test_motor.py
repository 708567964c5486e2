"""Moves, seeks, forced stops, LIMIT, jog, the position counter and what shows the motion (manual chapters VI, VII.2, VII.4)."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from m1486_rig import Bench, moving, speed

from steptwin.controller import SECOND
from steptwin.m1486.drive import MotionMode
from steptwin.m1486.lines import DUAL_DAC, STEP_DIRECTION, TWO_DACS
from steptwin.motion.pulses import step_times

STEP = 64


def duration(bench: Bench) -> float:
    """Seconds the last move took."""
    return (bench.events("stands")[-1].time - bench.events("moves")[-1].time) / SECOND


# ---------------------------------------------------------------------- moves


def test_m_3_the_default_move() -> None:
    # 96 full steps up from 200 to 1000 step/s at 5000 step/s² in 160 ms, and down again; the rest at 1000 step/s.
    bench = Bench()
    bench.do("r")
    assert (bench.counter, bench.true) == (64_000, 64_000)
    assert duration(bench) == pytest.approx(2 * 0.16 + (1000 - 2 * 96) / 1000, abs=1e-9)


def test_a_move_starts_and_ends_at_start_stop_speed() -> None:
    bench = moving("s100", "a1000", "v500", seconds=0)
    assert speed(bench) == pytest.approx(100, abs=2)
    bench.run(0.1)
    assert speed(bench) == pytest.approx(200, abs=2)
    bench.run(1.0)
    assert speed(bench) == 500


@pytest.mark.parametrize(("kind", "clock"), [("B", 1), ("B2x", 2)])
def test_at_24_mhz_speeds_are_doubled_and_accelerations_times_four(kind: str, clock: int) -> None:
    bench = Bench(kind)
    bench.do("s100", "a1000", "v500", "r")
    assert duration(bench) == pytest.approx((2 * 0.4 + (1000 - 2 * 120) / 500) / clock, abs=2e-9)


def test_m_8_a_speed_not_above_start_stop_is_constant() -> None:
    for velocity in (16, 199, 200):
        bench = Bench()
        bench.do(f"v{velocity}", "f6400", "r")
        assert duration(bench) == pytest.approx(100 / velocity, abs=2e-9)


def test_m_7_a_short_move_turns_half_way() -> None:
    bench = Bench()
    bench.do("f3200", "r")
    top = math.sqrt(200**2 + 2 * 5000 * 25)
    assert duration(bench) == pytest.approx(2 * (top - 200) / 5000, abs=2e-9)
    assert bench.true == 3200


@given(
    st.integers(16, 1950), st.integers(20, 7000), st.integers(16, 20_000), st.integers(1, 65_000), st.sampled_from(["B", "B2x"])
)
def test_m_6_the_speed_is_the_integral_of_its_acceleration(start: int, knee: int, top: int, acc: int, kind: str) -> None:
    """The chip's endless move against the differential equation: A up to P, then falling linearly in time to 0 at V."""
    bench = Bench(kind, statement_ns=0)
    bench.do(f"s{start}", f"p{knee}", f"v{top}", f"a{acc}", "g+")
    bench.send("r")
    begin, clock = bench.now, 2 if kind == "B2x" else 1
    steps = 2000
    # M-6: above P the acceleration at speed v is A √((V − v) / (V − P)).
    span = (top - start) / acc * 3 + 0.01
    v, x, dt = float(min(top, start)), 0.0, span / steps
    for _ in range(steps):

        def slope(v: float) -> float:
            if v >= top or top <= start:
                return 0.0
            return acc * math.sqrt((top - v) / (top - knee)) if v > knee and knee < top else float(acc)

        middle = min(v + slope(v) * dt / 2, top)
        x += middle * dt
        v = min(v + slope(middle) * dt, float(top))
    now = begin + round(span / clock * SECOND)
    profile = bench.chip.drive.profile
    assert profile.velocity(now) / STEP / clock == pytest.approx(v, rel=5e-3, abs=1.0)
    assert (profile.position(now)) / STEP == pytest.approx(x, rel=5e-3, abs=1.0)


def test_m_40_a_move_that_starts_above_p_begins_with_less_acceleration_than_a() -> None:
    """S 500, P 100, V 2000: at v the acceleration is A √((V − v) / (V − P)), so √(1500 / 1900) of A at the start."""
    bench = Bench()
    bench.do("s500", "p100", "v2000", "a5000", "g+")
    bench.send("r")
    profile = bench.chip.drive.profile
    begin, ms = bench.now, SECOND // 1000
    assert profile.velocity(begin) / STEP == pytest.approx(500)
    slope = (profile.velocity(begin + ms) - profile.velocity(begin)) / STEP * 1000
    assert slope == pytest.approx(5000 * math.sqrt(1500 / 1900), rel=2e-3)


def test_m_41_a_move_that_is_over_before_its_command_ends_with_the_time_of_the_command() -> None:
    """One full step at 20 000 step/s takes 0.5 ms: U follows R by the 1 ms of a command."""
    bench = Bench("B")
    bench.file("v20000", "s1950", "f64", "r", "u20")
    bench.finish()
    assert [(event.time, event.code) for event in bench.chip.events][1:] == [
        (3_000_000, "moves"),
        (3_512_653, "stands"),
        (4_000_000, "upload"),
    ]


def test_m_39_the_rest_of_a_distance_below_a_step_of_q_is_made_in_steps_of_m_at_start_stop_speed() -> None:
    """6401 with M64 and Q2: 200 steps of 32, then one of 1 at 500 × 64 a second."""
    bench = Bench("B", interface=DUAL_DAC)
    bench.do("m64", "q2", "s500", "v2000", "a50000", "f6401")
    begin = bench.now
    bench.send("r")
    bench.finish()
    train = bench.trains[-1][1]
    times = step_times(train, begin - 1, bench.now)
    assert len(times) == 200 + 1
    assert SECOND / (times[-1] - times[-2]) == pytest.approx(500 * 64, rel=0.01)
    assert bench.true == 6401


def test_p_above_v_switches_the_parabola_off() -> None:
    with_default = Bench()
    with_default.do("v2000", "r")
    without = Bench()
    without.do("v2000", "p2000", "r")
    parabolic = Bench()
    parabolic.do("v2000", "p1500", "r")
    assert duration(with_default) == duration(without) < duration(parabolic)


def test_directions_and_distances() -> None:
    bench = Bench()
    bench.do("=64000", "b640", "r")
    assert (bench.counter, bench.true) == (63_360, -640)
    bench.do("d", "r")
    assert (bench.counter, bench.true) == (64_000, 0)
    bench.do("f1280", "r", "r")
    assert bench.counter == 66_560


def test_g_finds_its_distance_when_it_is_done_and_m_9_r_repeats_it() -> None:
    # Chapter VII.2: at 9 000, G10000 is a distance of 1 000 in positive direction; here with multiples of M1.
    bench = Bench(interface=TWO_DACS)
    bench.do("=9008", "m8", "g10000", "r")
    assert (bench.counter, bench.true) == (10_000, 992)
    bench.do("r")
    assert bench.counter == 10_992
    bench.do("d", "r", "r")
    assert bench.counter == 9008


def test_m_10_h_is_a_specification() -> None:
    bench = Bench()
    bench.do("=6400", "h")
    assert bench.counter == 6400
    assert bench.events("moves") == []
    bench.do("r")
    assert (bench.counter, bench.true) == (0, -6400)


def test_a_move_of_no_distance_takes_no_time() -> None:
    bench = Bench()
    assert bench.do("h", "r", "u20") == b"\x42"
    assert bench.events("moves") == []


def test_distances_that_are_no_multiples_are_wrong_data() -> None:
    for m, grid in ((1, 64), (4, 16), (64, 1)):
        for command in ("f", "b", "g", "="):
            bench = Bench()
            bench.do(f"m{m}", f"{command}{grid}")
            assert bench.wrong == []
            if grid > 1:
                bench.do(f"{command}{grid + grid // 2}")
                assert f"is not a multiple of {grid} minimum microsteps (M{m})" in bench.wrong[0]
    # M may have changed since.
    bench = Bench(interface=TWO_DACS)
    bench.do("f16", "m1", "r")
    assert "16 is not a multiple of 64" in bench.wrong[0]


def test_settings_during_a_move_count_from_the_next_one() -> None:
    bench = moving("f640000", seconds=0.5)
    before = bench.chip.drive.profile
    bench.chip.drive.velocity = 500
    bench.run(0.1)
    assert bench.chip.drive.profile is before


# ---------------------------------------------------------------------- microsteps


def test_m_11_divisions_that_do_not_go_together_are_wrong_data_when_a_move_starts() -> None:
    allowed = {(1, 1), (64, 1), (64, 2), (64, 4), (32, 1), (32, 2), (32, 4), (16, 4), (8, 1), (8, 2), (4, 1), (4, 4), (2, 2)}
    for m in (1, 2, 4, 8, 16, 32, 64):
        for q in (1, 2, 4):
            for command in ("r", ")1"):
                bench = Bench()
                bench.pin(B1=1)
                bench.do(f"m{m}", f"q{q}", "f64")
                bench.send(command)
                bench.run(ms=5)
                assert bool(bench.wrong) is ((m, q) not in allowed)


@pytest.mark.parametrize(("q", "most"), [(4, 3000), (2, 6000), (1, 20_000)])
def test_m_34_the_highest_speed_with_q(q: int, most: int) -> None:
    bench = moving("m64", f"q{q}", "v20000", "a65000", "g+", seconds=2.0)
    assert speed(bench) == most
    bench = moving("m64", f"q{q}", "v20000", "a65000", "g+", kind="B2x", seconds=2.0)
    assert speed(bench) == 2 * most


@pytest.mark.parametrize("interface", [STEP_DIRECTION, DUAL_DAC, TWO_DACS], ids=lambda i: i.name)
@pytest.mark.parametrize(("m", "q"), [(1, 1), (64, 1), (64, 4), (8, 2), (4, 1)])
def test_pulses_lead_to_the_target_whatever_the_division(interface: object, m: int, q: int) -> None:
    bench = Bench(interface=interface)
    bench.do(f"m{m}", f"q{q}", "v4000", "a20000", "f128000", "r", f"b{64 // m * 37}", "r")
    assert bench.true == bench.sum_of_pulses() == 128_000 - 64 // m * 37


def test_the_division_changes_at_the_low_range_limit() -> None:
    # M8: 12 000 / 8 = 1500 step/s; doubled at 24 MHz together with the speeds.
    for kind in ("B", "B2x"):
        bench = moving("m8", "q1", "v3000", "f640000", kind=kind, seconds=3.0)
        train = bench.chip.drive.train
        assert [grid for _, grid in train.divisions] == [8, 64, 8]
        clock = bench.chip.variant.clock
        change = train.pulse_time(train.divisions[1].begin, 0)
        assert change is not None
        assert train.profile.velocity(change) / STEP / clock == pytest.approx(1500, rel=0.02)
        assert [grid for _, grid in moving("m8", "q1", "v1500", "f640000", kind=kind).chip.drive.train.divisions] == [8]


# ---------------------------------------------------------------------- jog


def test_m_18_jog_steps_one_microstep_in_its_direction() -> None:
    bench = Bench()
    bench.do("m8", "=640")
    for direction, position in ((0, 648), (1, 640), (1, 632)):
        bench.pin(B7=direction)
        bench.pin(JOG=0)
        bench.run(ms=1)
        bench.pin(JOG=1)
        bench.run(ms=1)
        assert bench.counter == position
        assert bench.level("DIRECTION") == direction
    assert bench.true == bench.sum_of_pulses() == -8


def test_there_is_no_jog_during_a_move_or_a_seek() -> None:
    bench = moving("f64000")
    bench.pin(JOG=0)
    bench.finish()
    assert bench.true == 64_000
    bench = Bench()
    bench.do("c52")
    bench.pin(B5=0)
    bench.send(")5")
    bench.run(0.1)
    bench.pin(JOG=0)
    bench.pin(B5=1)
    assert bench.true == 20 * STEP


@pytest.mark.parametrize(("line", "way"), [("r", 640), ("(1", -640)])
def test_a_move_begins_after_the_jog_step_that_is_being_made(line: str, way: int) -> None:
    bench = Bench()
    bench.do("m8", "f640", "s80", "c52")
    bench.pin(JOG=0)
    bench.send(line)
    assert bench.chip.drive.motion is MotionMode.JOG
    bench.run(ms=126)
    bench.pin(B1=0)
    bench.finish()
    assert bench.wrong == []
    assert bench.true == bench.sum_of_pulses() == pytest.approx(8 + way, abs=16)


# ---------------------------------------------------------------------- what shows the motion


def test_boost_is_low_during_moves_and_seeks_only() -> None:
    bench = Bench()
    assert bench.level("BOOST") == 1
    bench.file("w10", "f6400", "r", "w10", "(1")
    bench.run(ms=5)
    bench.pin(JOG=0)
    bench.finish(1)
    bench.pin(B1=0)
    bench.finish()
    edges = [(edge.time, edge.value) for edge in bench.edges if edge.pin == "BOOST"]
    begin, end = bench.events("moves")[0].time, bench.events("stands")[0].time
    assert edges[:2] == [(begin, 0.0), (end, 1.0)]
    assert [value for _, value in edges] == [0.0, 1.0, 0.0, 1.0]


def test_direction_is_high_for_negative_motion() -> None:
    bench = Bench()
    bench.do("f64", "r")
    assert bench.level("DIRECTION") == 0
    bench.do("b64", "r")
    assert bench.level("DIRECTION") == 1
    bench = Bench(interface=TWO_DACS)
    bench.do("b64", "r")
    assert bench.level("DIRECTION") == 0


def test_the_position_counter_has_24_bits() -> None:
    bench = Bench()
    bench.do("b6400", "r")
    assert bench.counter == 2**24 - 6400
    assert bench.do("u1", "u2", "u3") == (2**24 - 6400).to_bytes(3, "little")
    bench.do("f6400", "r")
    assert bench.counter == 0
    bench.do("=16000000", "f15999936", "v20000", "a65000", "r", "c100")
    assert bench.counter == 0
    assert bench.true == 15_999_936


@pytest.mark.parametrize(("letter", "direction"), [("f", 1), ("b", -1)])
def test_the_shortest_move_is_announced_with_its_direction_and_distance(letter: str, direction: int) -> None:
    """One minimum microstep, 1/64 of a full step."""
    bench = Bench()
    bench.do("m64", f"{letter}1", "r")
    (event,) = bench.events("moves")
    assert {fact: value for fact, value in event.facts if fact in ("direction", "distance")} == {
        "direction": direction, "distance": direction,
    }  # fmt: skip
    assert bench.true == direction
