"""Waveforms of analog inputs against closed formulas, and when a source drives its input."""

from __future__ import annotations

from math import pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mic488_rig import controller

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.logic.sources import AnalogSource, ConstantWaveform, SineWaveform, TableWaveform, Waveform
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.toml.reader import WorldError

POINTS = ((1.0, 1.0), (3.0, 5.0), (4.0, 2.0))


def test_a_constant_is_what_it_is() -> None:
    constant = ConstantWaveform(2.5)
    assert (constant.bounds, constant.volts(0.0), constant.volts(1e6), constant.rests(0.0)) == ((2.5, 2.5), 2.5, 2.5, True)


@pytest.mark.parametrize(
    ("t_s", "volts"),
    [(0.0, 1.0), (0.999, 1.0), (1.0, 1.0), (1.5, 2.0), (2.5, 4.0), (3.0, 5.0), (3.5, 3.5), (4.0, 2.0), (9.0, 2.0)],
)
def test_a_table_is_straight_between_its_points(t_s: float, volts: float) -> None:
    assert TableWaveform(POINTS).volts(t_s) == pytest.approx(volts)


@given(turn=st.integers(0, 50), t_s=st.floats(0.0, 3.9))
def test_a_repeated_table_begins_anew(turn: int, t_s: float) -> None:
    once, repeated = TableWaveform(POINTS), TableWaveform(POINTS, 4.0)
    assert repeated.volts(4.0 * turn + t_s) == pytest.approx(once.volts(t_s), abs=1e-9)


def test_a_table_rests_after_its_last_point_unless_it_is_repeated() -> None:
    assert TableWaveform(POINTS).bounds == (1.0, 5.0)
    assert [TableWaveform(POINTS).rests(t) for t in (0.0, 3.9, 4.0, 5.0)] == [False, False, True, True]
    assert not any(TableWaveform(POINTS, 4.0).rests(t) for t in (0.0, 4.0, 5.0))


@pytest.mark.parametrize("points", [(), ((1.0, 0.0), (1.0, 2.0)), ((2.0, 0.0), (1.0, 2.0))])
def test_the_points_of_a_table_come_one_after_the_other(points: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(Misuse, match="the points of a table need times that grow"):
        TableWaveform(points)


@given(
    mean=st.floats(0.0, 10.0),
    amplitude=st.floats(-5.0, 5.0),
    frequency=st.floats(0.0, 50.0),
    phase=st.floats(-360.0, 360.0),
    t_s=st.floats(0.0, 20.0),
)
def test_a_sine_is_that_of_the_formula(mean: float, amplitude: float, frequency: float, phase: float, t_s: float) -> None:
    wave = SineWaveform(mean, amplitude, frequency, phase)
    expected = mean + amplitude * sin(2 * pi * frequency * t_s + phase / 180 * pi)
    assert wave.volts(t_s) == pytest.approx(expected, abs=1e-9)
    low, high = wave.bounds
    assert (low, high) == (mean - abs(amplitude), mean + abs(amplitude))
    assert wave.rests(t_s) is (amplitude == 0.0 or frequency == 0.0)


def test_a_sine_begins_at_its_mean_and_rises() -> None:
    wave = SineWaveform(5.0, 2.0, 0.25)
    assert [wave.volts(t) for t in (0.0, 1.0, 2.0, 3.0)] == [5.0, 7.0, 5.0, 3.0]


def driven(waveform: Waveform, period_ms: float, until_s: float, begin: int = 0) -> tuple[list[tuple[int, float]], Scheduler]:
    """What AIN2 gets: moments in ms and volts."""
    edges: list[TraceRecord] = []
    scheduler = Scheduler(begin, record=edges.append)
    scheduler.add("m", Mic488Device(controller()))
    scheduler.add_part(AnalogSource(scheduler, PinName("m", "AIN2"), waveform, round(period_ms * MILLISECOND)))
    scheduler.advance(begin + round(until_s * SECOND))
    return [(r.time // MILLISECOND, float(str(r.value))) for r in edges if r.subject == "AIN2"], scheduler


def test_a_source_drives_its_input_once_in_a_period_to_the_millivolt() -> None:
    edges, _ = driven(TableWaveform(((0.0, 0.0), (1.0, 1.0009))), 250, 3.0)
    assert [moment for moment, _ in edges] == [0, 250, 500, 750, 1000]
    assert [volts for _, volts in edges] == pytest.approx([0.0, 0.250, 0.5, 0.751, 1.001], abs=1e-12)


def test_a_source_that_rests_has_no_deadline() -> None:
    ramp, scheduler = driven(TableWaveform(((0.0, 1.0), (1.0, 2.0))), 400, 5.0)
    assert ramp == [(0, 1.0), (400, 1.4000000000000001), (800, 1.8), (1200, 2.0)]
    assert scheduler.deadline() is None
    constant, scheduler = driven(ConstantWaveform(3.0), 100, 0.0)
    assert constant == [(0, 3.0)]
    assert scheduler.deadline() is None


def test_a_source_begins_with_its_scheduler() -> None:
    edges, scheduler = driven(SineWaveform(5.0, 1.0, 1.0), 250, 0.5, begin=10 * SECOND)
    assert edges == [(10_000, 5.0), (10_250, 6.0), (10_500, 5.0)]
    assert scheduler.deadline() == 10 * SECOND + 750 * MILLISECOND


def test_changes_below_a_millivolt_are_none() -> None:
    edges, _ = driven(SineWaveform(5.0, 0.0004, 1.0), 100, 2.0)
    assert edges == [(0, 5.0)]


@pytest.mark.parametrize(
    ("waveform", "period", "message"),
    [
        (ConstantWaveform(10.5), 1, r"source of m\.AIN2: 10\.5 V: an analog input takes 0 to 10 V$"),
        (ConstantWaveform(-0.1), 1, r"source of m\.AIN2: -0\.1 V: an analog input takes 0 to 10 V$"),
        (SineWaveform(5.0, -6.0, 1.0), 1, r"source of m\.AIN2: -1 to 11 V: an analog input takes 0 to 10 V$"),
        (ConstantWaveform(1.0), 0, r"source of m\.AIN2: a period of 0 ns is not positive$"),
    ],
)
def test_what_an_input_does_not_take_is_misuse(waveform: Waveform, period: int, message: str) -> None:
    scheduler = Scheduler()
    scheduler.add("m", Mic488Device(controller()))
    with pytest.raises(Misuse, match=message):
        AnalogSource(scheduler, PinName("m", "AIN2"), waveform, period)
    for bound in (0.0, 10.0):
        AnalogSource(scheduler, PinName("m", "AIN2"), ConstantWaveform(bound), 1)
    with pytest.raises(Misuse, match="no pin 'AIN9'"):
        AnalogSource(scheduler, PinName("m", "AIN9"), ConstantWaveform(1.0), 1)


NAMED = """
[[mic488]]
name = "c"
[[source]]
name = "oven"
to = "c.AIN1"
kind = "ramp"
end = 10
over = "10 s"
[[source]]
to = "c.AIN2"
value = 3.0
"""


def test_a_named_source_is_a_signal_and_has_faults() -> None:
    world = World.from_toml(NAMED)
    world.run(until="oven.volts > 2.5", for_="9 s")
    # Renewed every 10 ms, by 10 mV.
    assert (world.now, world.read("c.AIN1")) == (2510 * MILLISECOND, pytest.approx(2.51))
    world.fault("drift element=oven volts=-1 until_s=1")
    world.fault("broken-wire element=oven from_s=2 until_s=2.5")
    for until, volts in ((3.0, 2.0), (4.0, 4.0), (4.6, 0.0), (5.5, 5.5)):
        world.run(until=until)
        assert world.read("c.AIN1") == world.read("oven.volts") == pytest.approx(volts)
    assert world.read("c.AIN2") == 3.0
    with pytest.raises(Misuse, match=r"no signal 'source\.volts'"):
        world.read("source.volts")
    with pytest.raises(Misuse, match="those that can fail are oven"):
        world.fault("drift element=AIN2")


@pytest.mark.parametrize(
    ("kind", "message"), [("ramp", "a ramp needs 'over': how long it takes"), ("table", "a table needs points")]
)
def test_what_goes_nowhere_is_refused(kind: str, message: str) -> None:
    with pytest.raises(WorldError, match=message):
        World.from_toml(f'[[mic488]]\nname = "c"\n[[source]]\nto = "c.AIN1"\nkind = "{kind}"\n')


def test_a_ramp_may_be_as_short_as_a_nanosecond() -> None:
    world = World.from_toml(NAMED.replace('"10 s"', '"0.001 us"'))
    world.run(for_=0.1)
    assert world.read("oven.volts") == 10.0
