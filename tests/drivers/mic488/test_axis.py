"""One axis: what is sent, how long is waited, and why a motion ended."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest
from host_rig import Wire, driver, spindles

from steptwin.controller import SECOND
from steptwin.drivers import Mic488, MoveFailed, NotReady, Reason
from steptwin.errors import Misuse
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.status import AxisStatus


def ready(**options: object) -> tuple[Wire, Mic488]:
    wire = Wire(**options)  # type: ignore[arg-type]
    mic = driver(wire)
    mic.enable()
    wire.sent.clear()
    return wire, mic


def later(wire: Wire, seconds: float, act: object) -> None:
    """``act`` happens while a driver waits, this long from now."""
    moment = wire.now + round(seconds * SECOND)

    def look(_: bytes) -> None:
        if wire.now >= moment:
            wire.before_each = None
            act()  # type: ignore[operator]

    wire.before_each = look


# ---------------------------------------------------------------------- why a motion ended


def test_a_move_ends_at_its_target_in_units() -> None:
    wire, mic = ready()
    mic.axis(1).move_to(12.34)
    end = mic.axis(1).wait()
    assert (end.ok, end.reason, str(end)) == (True, Reason.TARGET, "M1: target reached at 12.34 mm")
    assert wire.position() == 1234
    mic.axis(1).move_by(-2.0)
    assert mic.axis(1).wait().position_u == pytest.approx(10.34)


@pytest.mark.parametrize(
    ("target", "reason", "text"),
    [(-50.0, Reason.LIMIT_L, "M1: stopped at limit L at -10 mm"), (900.0, Reason.LIMIT_R, "M1: stopped at limit R at 250 mm")],
)
def test_a_limit_is_named(target: float, reason: Reason, text: str) -> None:
    _, mic = ready()
    mic.axis(1).move_to(target)
    with pytest.raises(MoveFailed) as caught:
        mic.axis(1).wait()
    assert (caught.value.end.reason, str(caught.value)) == (reason, text)


def test_who_waits_is_told_of_a_stop() -> None:
    wire, mic = ready()
    mic.axis(1).move_to(100.0)
    later(wire, 1.0, lambda: wire.twin.axes[0].stop(wire.now))
    end = mic.axis(1).wait(check=False)
    assert (end.ok, end.reason) == (False, Reason.STOPPED)
    assert end.position_u == pytest.approx(wire.position() / 100)


def test_an_axis_that_was_stopped_on_purpose_is_at_rest() -> None:
    wire, mic = ready()
    mic.axis(1).move_to(100.0)
    wire.sleep(1.0)
    mic.axis(1).stop()
    assert mic.axis(1).wait().reason is Reason.REST


def test_a_drive_that_is_switched_off_is_named() -> None:
    wire, mic = ready()
    mic.axis(1).move_to(100.0)
    later(wire, 1.0, lambda: wire.twin.axes[0].disable(wire.now))
    assert mic.axis(1).wait(check=False).reason is Reason.DISABLED


def test_a_move_that_somebody_else_replaced_is_diverted() -> None:
    wire, mic = ready()
    other = driver(wire)
    mic.axis(1).move_to(100.0)
    later(wire, 1.0, lambda: wire.twin.axes[0].move_to(3000, wire.now))
    end = mic.axis(1).wait(check=False)
    assert str(end) == "M1: redirected by another command at 30 mm (the target was 100 mm)"
    assert not other.axis(1).wait(check=False).detail


@pytest.mark.parametrize("timeout_s", [None, 60.0])
def test_a_driver_without_configuration_tells_what_it_knows_of_a_target(timeout_s: float | None) -> None:
    """100 imp/mm: a target between pulses is not confirmed, and not refuted; one that was replaced is."""
    wire, _ = ready()
    mic = driver(wire, config=None)
    ends = []
    for target, replacement in ((20.0, None), (30.004, None), (60.0, 3100), (60.0, 4500)):
        mic.axis(1).move_to(target)
        if replacement is not None:
            later(wire, 0.3, lambda pulses=replacement: wire.twin.axes[0].move_to(pulses, wire.now))
        end = mic.axis(1).wait(timeout_s, check=False)
        ends.append((end.ok, str(end)))
    assert ends == [
        (True, "M1: target reached at 20 u"),
        (True, "M1: came to rest at 30 u (the target was 30.004 u)"),
        (False, "M1: redirected by another command at 31 u (the target was 60 u)"),
        (False, "M1: redirected by another command at 45 u (the target was 60 u)"),
    ]


@pytest.mark.parametrize(("err_time_ms", "knows", "distance"), [(2000, True, 5.0), (2000, False, 5.0), (9000, True, 100.0)])
def test_a_position_error_is_named(err_time_ms: int, knows: bool, distance: float) -> None:
    """The controller gives up long after the motion should have been over."""
    config = spindles()
    axis = dataclasses.replace(
        config.axes[0],
        mot_resol=400,
        enc_resol=400,
        pos_ctrl_mode=1,
        err_ctrl_mode=2,
        err_time_ms=err_time_ms,
        limit_mode=0,
        in_kl=20,
        in_kr=20,
    )
    wire, mic = ready(config=dataclasses.replace(config, axes=(axis, *config.axes[1:])), switches=False)
    if not knows:
        mic = driver(wire, config=None)
    wire.twin.couple_encoder(1, wire.twin.axes[0].encoder.coupling.BLOCKED, wire.now)
    mic.axis(1).move_to(distance)
    with pytest.raises(MoveFailed, match="M1: position error"):
        mic.axis(1).wait()


def test_a_line_that_fails_is_the_end_of_waiting() -> None:
    wire, mic = ready()
    mic.axis(1).move_to(100.0)
    wire.severed = True
    end = mic.axis(1).wait(check=False)
    assert (end.reason, end.position_u) == (Reason.COMMUNICATION, None)
    assert "no answer to 'unit 1: read the control registers'" in str(end)
    assert wire.moving()


def test_homing_is_waited_for() -> None:
    wire, mic = ready()
    mic.axis(2).home(-5.0)
    assert mic.axis(2).wait().reason is Reason.TARGET
    assert mic.axis(2).position() == 0.0
    assert wire.twin.axes[1].status is AxisStatus.REACHED


# ---------------------------------------------------------------------- how long is waited


@pytest.mark.parametrize(("distance", "duration"), [(8.0, 0.8), (100.0, 4.5)])
def test_the_time_out_is_computed_from_the_motion(distance: float, duration: float) -> None:
    """An axis that does not arrive is given up a fifth and a second after it should have."""
    wire, mic = ready()
    mic.axis(1).move_to(distance)
    begin = wire.now
    later(wire, 0.2, lambda: wire.twin.axes[0].move_velocity(1.0, wire.now))
    with pytest.raises(MoveFailed, match="M1: still moving") as caught:
        mic.axis(1).wait()
    assert caught.value.end.reason is Reason.OVERDUE
    assert (wire.now - begin) / SECOND == pytest.approx(1.2 * duration + 1.0, abs=0.2)


def test_a_time_out_may_be_given() -> None:
    wire, mic = ready()
    mic.axis(1).move_to(200.0)
    begin = wire.now
    assert mic.axis(1).wait(2.0, check=False).reason is Reason.OVERDUE
    assert (wire.now - begin) / SECOND == pytest.approx(2.0, abs=0.1)


def test_a_long_move_is_waited_for_to_its_end() -> None:
    wire, mic = ready()
    mic.axis(1).set_ramp(acc=0.5, dec=0.5, velocity=0.5)
    mic.axis(1).move_to(60.0)
    begin = wire.now
    assert mic.axis(1).wait().ok
    assert (wire.now - begin) / SECOND == pytest.approx(121.0, abs=0.2)


def test_velocity_mode_does_not_end_by_itself() -> None:
    _, mic = ready()
    mic.axis(1).move_velocity(5.0)
    with pytest.raises(Misuse, match="M1 runs in velocity mode and does not end by itself: give timeout_s"):
        mic.axis(1).wait()
    assert mic.axis(1).wait(1.0, check=False).reason is Reason.OVERDUE
    for seconds in (float("nan"), float("inf"), -1.0):
        with pytest.raises(Misuse, match=f"a time to wait of {seconds:g} s is outside 0 to 1000000 s"):
            mic.axis(1).wait(seconds, check=False)
    mic.axis(1).move_velocity(0.0)
    assert mic.axis(1).wait().reason is Reason.REST


def test_several_axes_are_waited_for_with_one_frame_a_poll() -> None:
    wire, mic = ready()
    mic.move_together({1: 10.0, 2: 20.0, 3: 30.0})
    before = len(wire.sent)
    ends = mic.wait(1, 2, 3)
    assert [end.position_u for end in ends.values()] == [10.0, 20.0, 30.0]
    polls = len(wire.sent) - before
    assert polls <= (wire.sent[-1][0] - wire.sent[before][0]) / (0.05 * SECOND) + 10


# ---------------------------------------------------------------------- what is refused


def test_an_axis_that_is_off_is_not_moved() -> None:
    wire, mic = ready()
    mic.axis(3).disable()
    wire.sent.clear()
    for act in (lambda a: a.move_to(1.0), lambda a: a.move_by(1.0), lambda a: a.move_velocity(1.0), lambda a: a.home(1.0)):
        with pytest.raises(NotReady, match="M3 of unit 1 is switched off: enable it first"):
            act(mic.axis(3))
    assert {frame[1] for _, frame in wire.sent} == {3}  # only reads


def test_a_trigger_mode_that_somebody_left_is_told() -> None:
    _, mic = ready()
    mic.set("AXIS_CTR_MODE", 1)
    with pytest.raises(NotReady, match="in which a motion waits for its trigger: set AXIS_CTR_MODE to 0"):
        mic.axis(1).move_to(1.0)


def test_ranges_are_in_units() -> None:
    _, mic = ready()
    with pytest.raises(Misuse, match=r"M1: velocity 1e\+06 mm/s is outside -640…640 mm/s"):
        mic.axis(1).move_velocity(1e6)
    with pytest.raises(Misuse, match=r"M1: position 3e\+07 mm is outside"):
        mic.axis(1).move_to(3e7)
    with pytest.raises(Misuse, match="M1: nan mm is not a position"):
        mic.axis(1).move_to(math.nan)
    with pytest.raises(Misuse, match="homing of M1 at 0 mm/s: the sign of the velocity chooses the switch"):
        mic.axis(1).home(0.0)
    with pytest.raises(Misuse, match="no axis 5: axes are 1 to 4"):
        mic.axis(5)
    with pytest.raises(Misuse, match="direction 2"):
        mic.axis(1).jog_bit(2, on=True)


def test_settings_reach_the_registers() -> None:
    wire, mic = ready()
    axis = mic.axis(1)
    axis.set_ramp(acc=10.0, dec=20.0, velocity=3.0)
    axis.set_limits(left=-1.0, right=7.0)
    axis.set_position(5.0)
    assert mic.get("M1_ACC", "M1_DEC", "M1_VMAX", "M1_POSLIM_L", "M1_POSLIM_R", "M1_POS_ACT") == {
        "M1_ACC": 10.0,
        "M1_DEC": 20.0,
        "M1_VMAX": 3.0,
        "M1_POSLIM_L": -1.0,
        "M1_POSLIM_R": 7.0,
        "M1_POS_ACT": 5.0,
    }
    axis.move_to(50.0)
    assert axis.wait(check=False).reason is Reason.LIMIT_R
    assert wire.position() == pytest.approx(700, abs=1)


def test_the_jog_coils_run_until_they_are_off() -> None:
    wire, mic = ready()
    mic.set_jog_speed(2.0)
    mic.axis(1).jog_bit(1, on=True)
    wire.rest(20.0)
    assert mic.axis(1).velocity() == 2.0
    mic.axis(1).jog_bit(1, on=False)
    wire.rest(1.0)
    assert not wire.moving()


def test_units_and_encoder() -> None:
    wire, mic = ready()
    assert mic.axis(1).unit == "mm"
    assert repr(mic.axis(1)) == "<Mic488Axis M1 of unit 1 on memory>"
    wire.twin.turn_encoder(1, 40, wire.now)
    assert mic.axis(1).encoder() == 40
    assert driver(Wire(config=ControllerConfig()), config=None).axis(1).unit == "u"


def test_without_a_configuration_positions_are_still_those_of_the_registers() -> None:
    wire = Wire()
    mic = driver(wire, config=None)
    mic.enable(1)
    mic.axis(1).move_to(5.0)
    assert str(mic.axis(1).wait()) == "M1: target reached at 5 u"
    assert wire.position() == 500


@pytest.mark.parametrize("direction", [-2, 0, 2])
def test_a_jog_coil_has_two_directions(direction: int) -> None:
    wire, mic = ready()
    for on in (True, False):
        with pytest.raises(Misuse, match=f"direction {direction}: permitted are 1 and -1"):
            mic.axis(1).jog_bit(direction, on=on)
    assert wire.sent == []
    mic.set_jog_speed(2.0)
    mic.axis(1).jog_bit(-1, on=True)
    wire.sleep(1.0)
    assert wire.position() < 0
    mic.axis(1).jog_bit(-1, on=False)
    wire.rest()
    assert not wire.moving()


def test_a_ramp_that_no_axis_has_is_refused_before_it_is_sent() -> None:
    wire, mic = ready()
    wire.sent.clear()
    for velocity in (641.0, 1e30, float("nan")):
        with pytest.raises(Misuse, match=r"^M1: (velocity .* mm/s is outside|nan mm/s is not a velocity)"):
            mic.axis(1).set_ramp(velocity=velocity)
    assert wire.sent == []
    mic.axis(1).set_ramp(velocity=640.0)
    assert mic.get("M1_VMAX") == {"M1_VMAX": 640.0}


def test_drives_are_switched_one_by_one_and_together() -> None:
    wire = Wire()
    mic = driver(wire)

    def on() -> list[bool]:
        return [axis.status != AxisStatus.OFF for axis in wire.twin.axes]

    mic.axis(2).enable()
    assert on() == [False, True, False, False]
    mic.enable(1, 4)
    assert on() == [True, True, False, True]
    mic.axis(2).disable()
    mic.disable(4)
    assert on() == [True, False, False, False]
    mic.enable()
    assert on() == [True] * 4
    mic.disable()
    assert on() == [False] * 4


def test_whatever_stops_goes_before_what_waits_and_is_sent_five_times() -> None:
    _, mic = ready()
    unit = mic._driver._unit
    asked: list[tuple[str, bool, int | None]] = []
    inner = unit.write

    async def write(item: Any, value: Any, **options: Any) -> None:
        asked.append((item.name, options.get("urgent", False), options.get("most_attempts")))
        await inner(item, value, **options)

    unit.write = write  # type: ignore[method-assign]
    mic.axis(1).stop()
    mic.axis(1).disable()
    mic.axis(1).jog_bit(1, on=False)
    mic.stop_all()
    mic.disable(1, 2)
    assert [(urgent, most) for _, urgent, most in asked] == [(True, 5)] * 5, asked


@pytest.mark.parametrize("velocity", [-640.0, 640.0])
def test_the_fastest_motions_that_there_are(velocity: float) -> None:
    wire, mic = ready()
    mic.axis(1).move_velocity(velocity)
    assert wire.moving()
