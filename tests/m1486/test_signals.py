"""What the driver interfaces put on their pins: STEP, the converters, STROBE (manual chapters II, IV, VI)."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m1486_rig import Bench

from steptwin.controller import SECOND
from steptwin.m1486.lines import DUAL_DAC, TWO_DACS
from steptwin.m1486.signals import DATA_VALID_NS, STEP_PULSE_NS, data_level, phase_level, step_pulses, strobes
from steptwin.motion.waveforms import CHARACTERISTICS, currents


def test_times_of_chapter_4() -> None:
    """Step pulse width 1,8 µs; data valid to Strobe transition 960 ns."""
    assert (STEP_PULSE_NS, DATA_VALID_NS) == (1800, 960)


def test_step_gives_one_pulse_for_each_microstep() -> None:
    bench = Bench()
    bench.do("m8", "v1000", "f6400", "r")
    pulses = step_pulses(bench.chip.drive.train, 0, bench.now)
    assert len(pulses) == 800
    # Slowest at the ends, at start/stop speed; never faster than V, and far enough apart for a pulse.
    gaps = pulses[1:] - pulses[:-1]
    assert gaps.min() >= SECOND // (1000 * 8) > STEP_PULSE_NS
    assert gaps.max() <= SECOND / (200 * 8)


def test_the_fastest_pulses_leave_room_for_their_width() -> None:
    bench = Bench("B2x")
    bench.do("v20000", "a65000", "f6400000", "r")
    pulses = step_pulses(bench.chip.drive.train, 0, bench.now)
    assert len(pulses) == 100_000
    assert (pulses[1:] - pulses[:-1]).min() == 25_000


@settings(max_examples=30)
@given(
    st.sampled_from([(1, 1), (4, 1), (4, 4), (8, 2), (64, 4)]),
    st.integers(1, 30),
    st.booleans(),
    st.lists(st.floats(0, 1), max_size=4),
)
def test_windows_of_pulses_make_the_whole(mq: tuple[int, int], steps: int, forward: bool, cuts: list[float]) -> None:
    bench = Bench(statement_ns=0)
    distance = 64 // mq[0] * steps
    bench.do(f"m{mq[0]}", f"q{mq[1]}", "s1900", f"{'f' if forward else 'b'}{distance}", "r")
    train = bench.chip.drive.train
    times = step_pulses(train, 0, bench.now).tolist()
    edges = [0, *sorted(round(cut * bench.now) for cut in cuts), bench.now]
    parts = [t for a, b in itertools.pairwise(edges) for t in step_pulses(train, a, b).tolist()]
    assert parts == times
    assert [train.count(t) for t in times][-1] == (distance if forward else -distance)


# ---------------------------------------------------------------------- converters


@pytest.mark.parametrize("characteristic", CHARACTERISTICS)
def test_dual_dac_latches_both_phases_for_each_step(characteristic: int) -> None:
    bench = Bench(interface=DUAL_DAC)
    bench.do(f"n{characteristic}", "v100", "f256", "r")
    train = bench.chip.drive.train
    pulses = step_pulses(train, 0, bench.now).tolist()
    data = list(strobes(train, characteristic, 0, bench.now))
    # M4: 16 microsteps in an electrical period.
    assert len(pulses) == 16
    assert [(strobe.time, strobe.channel) for strobe in data] == [
        (pulse + lag, channel) for pulse in pulses for channel, lag in ((1, DATA_VALID_NS), (2, 3 * DATA_VALID_NS))
    ]
    signed = [(-strobe.magnitude if strobe.phase else strobe.magnitude) for strobe in data]
    assert signed == [value for k in range(1, 17) for value in currents(characteristic, 16 * k)]


@pytest.mark.parametrize("direction", ["f", "b"])
def test_converter_data_follow_the_division_in_flight(direction: str) -> None:
    # From any moment on: 64 microsteps below 187.5 step/s, 1 above.
    bench = Bench(interface=DUAL_DAC)
    bench.do("m64", "q1", "s50", "a900", "v600", f"{direction}64000", "r")
    train = bench.chip.drive.train
    assert len(train.divisions) == 3
    whole = list(strobes(train, 1, 0, bench.now))
    for strobe in whole:
        first, second = currents(1, train.count(strobe.time))
        assert (-strobe.magnitude if strobe.phase else strobe.magnitude) == (first if strobe.channel == 1 else second)
    for share in (0.1, 0.4, 0.95):
        after = round(bench.now * share)
        assert list(strobes(train, 1, after, bench.now)) == [
            s for s in whole if s.time - (2 * s.channel - 1) * DATA_VALID_NS > after
        ]


def test_two_dacs_show_the_present_currents() -> None:
    bench = Bench(interface=TWO_DACS)
    for position in range(16, 16 * 17, 16):
        bench.do("f16", "r")
        first, second = bench.chip.drive.currents(bench.now)
        assert (first, second) == currents(1, position)
        magnitudes = sum(bench.level(f"B{line}") << line - 10 for line in range(10, 17))
        assert magnitudes == abs(second)
        assert bench.level("B17") == int(second < 0)
        assert bench.level("B8") | bench.level("B9") << 1 == abs(first) & 3


def test_m_25_phase_is_high_for_negative_current() -> None:
    assert (phase_level(-1), phase_level(0), phase_level(127)) == (1, 0, 0)
    assert [data_level(17, (0, current)) for current in (-5, 5)] == [1, 0]


def test_n_changes_the_currents_at_rest() -> None:
    bench = Bench(interface=TWO_DACS)
    bench.do("f32", "r")
    assert bench.chip.drive.currents(bench.now) == (90, -90)
    bench.do("n2")
    assert bench.chip.drive.currents(bench.now) == (127, -127)


def test_currents_go_back_with_the_motor() -> None:
    bench = Bench(interface=TWO_DACS)
    before = bench.chip.drive.currents(0)
    bench.do("f6416", "r", "d", "r")
    assert bench.chip.drive.currents(bench.now) == before
    # The position counter is another thing: setting it does not move the motor.
    bench.do("=32")
    assert bench.chip.drive.currents(bench.now) == before
