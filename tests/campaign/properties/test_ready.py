"""Ready properties on moving machines: each holds in a run, and a real mistake violates it."""

from __future__ import annotations

import pytest
from slides import GUARD, slide

from steptwin.campaign.properties import Verdict, read_property
from steptwin.files.world import World
from steptwin.simulation.script.steps import Send

# M1 goes to 100 mm from 1 ms on; a ram comes across at 60 mm when OUT1 is on.
SLIDE = (
    slide(travel=None)
    + GUARD
    + """
[[cylinder]]
name = "ram"
extend = "valve.out"
stroke = 80.0
extend_time = "400 ms"
retract_time = "400 ms"

[[gate]]
name = "valve"
kind = "or"
inputs = 1

[[button]]
name = "lower"
to = "valve.in1"

[[collision]]
name = "crash"
when = "ram.position > 40 and x.position > 60"

[[script]]
name = "go"
steps = [
  { write = { "table.M1_EN" = 1 } },
  { wait = "100 ms" },
  { write = { "table.M1_POS_ABS" = 100.0 } },
]
"""
)
# 64 microsteps for each of 200 full steps; F256000 are 20 turns with at most 800 full steps/s, 4 turns a second.
DRUM = """
[[line]]
name = "host"
kind = "m1486"

[[m1486]]
name = "drum"
line = "host"
variant = "E1"
address = 3

[[axis]]
name = "d"
drive = "drum.M1"
kind = "rotary"
unit = "rev"

[[cylinder]]
name = "ram"
extend = "valve.out"
stroke = 80.0
extend_time = "400 ms"
retract_time = "400 ms"

[[gate]]
name = "valve"
kind = "or"
inputs = 1

[[button]]
name = "lower"
to = "valve.in1"

[[button]]
name = "guard"
to = "drum.B3"

[[collision]]
name = "crash"
when = "ram.position > 40 and d.position > 10"

[[script]]
name = "go"
steps = [
  { send = "host", text = "x3\\rs60\\ra1500\\rv800\\r" },
  { wait = "1 s" },
  { send = "host", text = "f256000\\rr\\r" },
]
"""

MOVING = {SLIDE: "table.M1.moving", DRUM: "drum.moving"}
BOTH = pytest.mark.parametrize("text", [SLIDE, DRUM], ids=["MIC488", "M1486"])


def moving(text: str) -> World:
    """A machine at 4 s of the drum, 1 s of the slide: both turn at full speed."""
    world = World.from_toml(text)
    world.run(until=1.0 if text == SLIDE else 4.0)
    assert world.read(MOVING[text]) == 1
    return world


def ended(world: World, text: str, stopped: bool = True) -> World:
    """Stopped, or at its target; and a while later."""
    if not stopped:
        world.run(until=f"not {MOVING[text]}", for_="20 s")
    elif text == SLIDE:
        world.mic488["table"].write("M1_STOP", 1)
    else:
        world.at(world.time, Send("host", b"k\r"), name="stop")
    world.run(for_="2 s")
    assert world.read(MOVING[text]) == 0
    return world


def said(text: str, which: str, *, press: str = "", fault: str = "", stopped: bool = True) -> tuple[Verdict, float]:
    """What a property says of a run in which something happens to the moving machine, and when that was, s."""
    world = moving(text)
    watch = read_property(which).watch(world)
    began = world.time
    if press:
        world.press(press)
    if fault:
        world.fault(fault)
    world.run(for_="100 ms")
    ended(world, text, stopped)
    return watch.verdict(), began


@BOTH
def test_a_collision_is_seen_at_its_moment(text: str) -> None:
    """The ram is across half of its stroke, 40 mm in 0.2 s; the machine is there then, or comes there."""
    verdict, began = said(text, "no-collision", press="lower", stopped=False)
    assert not verdict.holds
    assert verdict.at_ns is not None
    assert verdict.at_ns / 1e9 > began + 0.2
    assert said(text, "no-collision", press="guard", stopped=False)[0].holds


@BOTH
def test_a_motion_with_an_open_guard(text: str) -> None:
    verdict, began = said(text, "never-moves-while guard.pressed", press="guard")
    assert (verdict.holds, verdict.at_ns) == (False, round(began * 1e9))
    assert said(text, "never-moves-while guard.pressed", press="lower")[0].holds


@BOTH
def test_a_stop_that_comes_too_late(text: str) -> None:
    """It is stopped when the guard opens and has a ramp, or goes on to its target."""
    late, began = said(text, "stops-within 700 ms after guard.pressed", press="guard", stopped=False)
    assert not late.holds
    assert late.at_ns == pytest.approx((began + 0.7) * 1e9, abs=10)
    in_time, _ = said(text, "stops-within 700 ms after guard.pressed", press="guard")
    assert in_time.holds
    assert 0.0 < in_time.robustness < 1.0


@BOTH
def test_lost_steps_that_nobody_notices(text: str) -> None:
    fault = "stall axis=1 for_s=0.2" if text == SLIDE else "stall for_s=0.2"
    unnoticed, _ = said(text, "no-lost-step-unnoticed guard.pressed within 300 ms", fault=fault)
    assert not unnoticed.holds
    assert said(text, "no-lost-step-unnoticed guard.pressed within 300 ms", fault=fault, press="guard")[0].holds
    assert said(text, "no-lost-step-unnoticed within 700 ms", fault=fault)[0].holds  # its drive stops
    assert not said(text, "no-lost-step-unnoticed within 700 ms", fault=fault, stopped=False)[0].holds


def test_how_near_an_axis_is_to_losing_steps_is_the_torque_that_it_has_left() -> None:
    """Of 1 N·m at 0 and all speeds of a slow move: friction takes a part, and nothing counts while the motor has no current."""

    def robustness(friction: float) -> float:
        world = World.from_toml(
            '[[mic488]]\nname = "c"\n[[axis]]\nname = "x"\ndrive = "c.M1"\npitch = 5.0\n'
            f"motor = {{ torque = [[0, 1.0], [6000, 1.0]], start_speed = 100, friction = {friction} }}\n"
        )
        watch = read_property("no-lost-step-unnoticed").watch(world)
        world.run(for_=0.1)
        world.mic488["c"].axis[1].enable()
        world.mic488["c"].axis[1].move_by(2000)
        world.run(for_=1.0)
        verdict = watch.verdict()
        assert verdict.holds
        return verdict.robustness

    assert robustness(0.2) == pytest.approx(0.8, abs=0.001)
    assert robustness(0.9) == pytest.approx(0.1, abs=0.001)


@BOTH
def test_the_return_to_a_safe_state(text: str) -> None:
    safe = f"returns-to-safe not {MOVING[text]} and not guard.pressed"
    assert said(text, safe)[0].holds
    assert not said(text, safe, press="guard")[0].holds
    assert said(text, f"returns-to-safe not {MOVING[text]} within 700 ms")[0].holds
    assert not said(text, f"returns-to-safe not {MOVING[text]} within 700 ms", stopped=False)[0].holds
