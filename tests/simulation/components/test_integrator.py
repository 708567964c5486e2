"""Quantities that integrate, against an integration of their own by scipy, and against numbers by hand."""

from __future__ import annotations

from pathlib import Path

import pytest
from scipy.integrate import solve_ivp
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.errors import Runaway
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "c"
[[cylinder]]
name = "valve"
extend = "c.OUT1"
stroke = 10.0
extend_time = "200 ms"
retract_time = "100 ms"
[[dcmotor]]
name = "pump"
speed = 600
run = "c.OUT2"
run_up = "1 s"
coast = "2 s"
[[integrator]]
name = "tank"
unit = "l"
start = 20
low = 0
high = 40
reset = "c.OUT8"
rate = "0.01 * pump.speed - 1.5 * valve.position * (c.OUT3 < 1)"
[[integrator.switch]]
below = 15.0
to = "c.IN1"
"""


def world(text: str = TEXT) -> World:
    return World.from_toml(text, name="w.toml")


def write(world: World, **outputs: float) -> None:
    for name, level in outputs.items():
        world.mic488["c"].write(name, level)


def test_a_value_is_exact_at_each_moment() -> None:
    """1.5 l while the valve opens, then 15 l/s."""
    here = world()
    write(here, OUT1=1)
    here.run(for_="100 ms")
    assert here.read("tank.value") == pytest.approx(20 - 1.5 * 10 * 0.1**2 / 0.2 / 2, abs=1e-9)
    here.run(until="tank.value < 15", for_="5 s")
    assert here.now == pytest.approx((0.2 + 3.5 / 15) * SECOND, abs=1.5)
    assert here.read("c.IN1") == 1.0
    here.run(for_="5 s")
    assert (here.read("tank.value"), here.read("tank.at_low"), here.read("tank.rate")) == (0.0, 1.0, 0.0)


def test_it_turns_where_its_rate_does() -> None:
    """The pump runs up by 6 l/s² against 1.5 l/s of a valve that is stuck at 1 mm: lowest after 0.25 s."""
    here = world()
    here.fault("jam element=valve from_s=0.02")
    write(here, OUT1=1)
    here.run(for_="100 ms")
    before = here.read("tank.value")
    write(here, OUT2=1)
    here.run(until="tank.rate > 0", for_="5 s")
    assert here.now == pytest.approx(0.35 * SECOND, abs=1.5)
    assert here.read("tank.value") == pytest.approx(before - 1.5 * 0.25 / 2, abs=1e-9)
    here.run(until="tank.value >= 20", for_="5 s")
    t = (1.5 + (1.5**2 + 2 * 6 * (20 - before)) ** 0.5) / 6
    assert here.now == pytest.approx((0.1 + t) * SECOND, abs=1.5)


def test_it_leaves_its_limit_when_its_rate_turns_back() -> None:
    here = world()
    write(here, OUT1=1)
    here.run(for_="3 s")
    write(here, OUT2=1)
    assert here.run(until="not tank.at_low", for_="5 s") is None, "6 l/s come, 15 l/s could go"
    began = here.now
    write(here, OUT1=0)
    here.run(until="not tank.at_low", for_="5 s")
    assert here.now == pytest.approx(began + 0.06 * SECOND, abs=1.5), "at 4 mm as much comes as goes"
    here.run(until="tank.at_high", for_="20 s")
    assert here.read("tank.value") == 40.0
    write(here, OUT2=0, OUT8=1)
    here.run(for_="1 ms")
    assert (here.read("tank.value"), here.read("tank.at_high")) == (20.0, 0.0)
    here.run(for_="1 s")
    assert here.read("tank.value") == 20.0


ACTS = ((0.1, "OUT1", 1), (0.25, "OUT2", 1), (0.5, "OUT3", 1), (0.9, "OUT3", 0), (1.15, "OUT1", 0), (1.2, "OUT1", 1))


def test_against_an_integration() -> None:
    """It shares no code: speed and opening are equations of their own, with their limits."""
    here, levels, expected = world(), dict.fromkeys(("OUT1", "OUT2", "OUT3"), 0), [0.0, 0.0, 20.0]

    def rates(t: float, state: list[float]) -> list[float]:
        opening, speed, _ = state
        moved = (50.0 if opening < 10 else 0.0) if levels["OUT1"] else (-100.0 if opening > 0 else 0.0)
        faster = (600.0 if speed < 600 else 0.0) if levels["OUT2"] else (-300.0 if speed > 0 else 0.0)
        return [moved, faster, 0.01 * speed - (0.0 if levels["OUT3"] else 1.5 * opening)]

    before = 0.0
    for moment, output, level in (*ACTS, (2.0, "OUT2", 0), (2.4, "OUT1", 1)):
        found = solve_ivp(rates, (before, moment), expected, max_step=2e-4)
        opening, speed, level_l = (float(one[-1]) for one in found.y)
        expected = [min(max(opening, 0.0), 10.0), min(max(speed, 0.0), 600.0), level_l]
        here.run(until=moment)
        assert here.read("tank.value") == pytest.approx(expected[2], abs=5e-3)
        assert here.read("pump.speed") == pytest.approx(expected[1], abs=0.2)
        write(here, **{output: level})
        levels[output], before = level, moment


def test_a_switch_of_a_small_quantity_changes_when_its_value_is_there() -> None:
    """A millilitre in cubic metres."""
    drip = '[[integrator]]\nname = "drip"\nunit = "m3"\nrate = "0.0000001 * c.OUT1"\n'
    drip += '[[integrator.switch]]\nabove = 1e-6\nto = "c.IN2"\n'
    here = world(TEXT + drip)
    write(here, OUT1=1)
    here.run(until="c.IN2 == 1", for_="20 s")
    assert here.now == pytest.approx(10 * SECOND, abs=1.5)


def test_its_rate_may_be_multiplied_by_a_fault() -> None:
    here = world()
    here.fault("other-rate element=tank factor=0.5 from_s=1")
    write(here, OUT2=1)
    here.run(until=2.0)
    assert here.read("tank.value") == pytest.approx(20 + 3.0 + 3.0, abs=1e-9)


def test_it_can_be_restored(tmp_path: Path) -> None:
    text = TEXT + '[[event]]\nat = "20 ms"\nsteps = [{ write = { "c.OUT1" = 1, "c.OUT2" = 1 } }]\n'
    check_it_can_be_restored(world(text), world(text), 0.15, 3.0, tmp_path)


def test_what_is_on_it_moves_by_its_value() -> None:
    text = TEXT.replace("[[integrator.switch]]", 'mm_per_unit = 10\nalong = "+z"\n[[integrator.switch]]')
    text += '[[body]]\nname = "float"\non = "tank"\nsize = [20, 20, 10]\n'
    text += '[[body]]\nname = "stop"\nat = [0, 0, 330]\nsize = [30, 30, 10]\n'
    here = world(text + '[[collision]]\nname = "full"\nbetween = ["float", "stop"]\n')
    write(here, OUT2=1)
    here.run(until="full.hit", for_="10 s")
    assert here.read("tank.value") == pytest.approx(32.0, abs=1e-6), "330 mm are 33 l, less the 10 mm of the float"


KEPT_BY_A_BEAM = """
[[mic488]]
name = "c"
[[integrator]]
name = "level"
unit = "ml"
rate = "100 - 150 * eye.seen"
mm_per_unit = 0.5
along = "+z"
[[body]]
name = "surface"
on = "level"
diameter = 60
height = 10
[[beam]]
name = "eye"
at = [0, 0, 200]
along = "-z"
length = 50
hysteresis = 20
sees = ["surface"]
to = "c.IN1"
"""


def test_a_beam_that_sees_what_is_on_it_may_be_in_its_rate() -> None:
    """It rises 140 mm at 50 mm/s; from then on the beam, which is 20 mm longer while it sees something, keeps it there."""
    world = World.from_toml(KEPT_BY_A_BEAM)
    world.run(for_=10)
    edges = [(record.time / SECOND, record.level()) for record in world.trace.of("edge") if record.subject == "IN1"]
    assert [level for _, level in edges[:4]] == [0.0, 1.0, 0.0, 1.0]
    assert [time for time, _ in edges[1:4]] == pytest.approx([2.8, 3.6, 4.0], abs=1e-7)


def test_a_beam_that_switches_its_own_reason_off_at_once_ends_the_run() -> None:
    """Without a hysteresis the level turns back each nanosecond: the run would come no further."""
    world = World.from_toml(KEPT_BY_A_BEAM.replace("hysteresis = 20\n", ""))
    with pytest.raises(
        Runaway, match=r"eye changes again and again, 1000 times .* until 28000.* ns: .* a sensor needs a hysteresis"
    ):
        world.run(for_=10)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("pump.speed -", "pump.angle -", "rate: 'pump.angle' changes between events, and is not known to go on"),
        ("pump.speed -", "tank.rate -", "'tank' depends on itself"),
        ("pump.speed -", "pump.speed * valve.position -", "pump.speed, valve.position: multiplied"),
        ("0.01 * pump.speed", "abs(pump.speed)", "pump.speed: multiplied"),
        ("0.01 *", "1 / pump.speed *", "pump.speed: multiplied"),
        ("pump.speed -", "pump.sped -", r"no signal 'pump.sped' \(did you mean 'speed'\?\)"),
        ("0.01 *", "0.01 cm *", "0.01 cm is compared with what has no unit"),
        ("start = 20", "start = 50", "start = 50 is beyond low = 0 and high = 40"),
        ("low = 0", "low = 40", "low = 40 is not below high = 40"),
        ("unit = \"l\"", "unit = \"mm\"\nmm_per_unit = 2\nalong = \"+z\"", "is in mm, which is a length already"),
        ("unit = \"l\"", "unit = \"l\"\nalong = \"+z\"", "'tank' counts in l: what is on it needs its mm_per_unit"),
    ],
)  # fmt: skip
def test_what_is_wrong(old: str, new: str, message: str) -> None:
    with pytest.raises(WorldError, match=message):
        world(TEXT.replace(old, new))
