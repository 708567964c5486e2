"""Dead-man jogs of twins, kept as the studio keeps them: bounded moves only, and a standstill in time whatever happens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from deadmanjog_rig import MIC, TIMED, Rig, chip, mic
from mic488_rig import loaded

from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse, Refusal
from steptwin.files.world import World
from steptwin.mic488.registers import AXIS_STATUS_TEXTS
from steptwin.mic488.status import AxisStatus
from steptwin.simulation.kinds.m1486.deadmanjog import M1486DeadManJog
from steptwin.simulation.kinds.mic488.deadmanjog import Mic488DeadManJog
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.deadmanjog import STOP_NS
from steptwin.subject.commands import Enable, Home, Jog, StopAxes
from steptwin.subject.payloads import FramePayload, PlanPayload


@pytest.mark.parametrize("timing", ["", TIMED])
@pytest.mark.parametrize("acc", [20.0, 100.0, 400.0, 5000.0])
@pytest.mark.parametrize("renewals", [0, 1, 7])
def test_a_mic488_stands_in_time_after_the_last_renewal(acc: float, renewals: int, timing: str) -> None:
    rig = mic(acc, timing)
    held = rig.begin(Jog("a", 1, 40.0))
    for _ in range(renewals):
        rig.run(held.lasts_ns / MILLISECOND / 3)
        held.extend()
    last = rig.world.now
    rig.run(50)
    assert rig.position("a.M1.velocity") > 0
    rig.run(2000)
    assert rig.position("a.M1.velocity") == 0
    assert rig.stands_at() <= last + 300 * MILLISECOND
    assert held.over == "lapsed"
    assert rig.jogs.deadline() is None


@pytest.mark.parametrize(("acc", "lasts_ms"), [(20.0, 160), (100.0, 160), (400.0, 170), (800.0, 220), (5000.0, 250)])
def test_a_jog_of_a_mic488_lasts_as_long_as_braking_leaves_time(acc: float, lasts_ms: int) -> None:
    """Of 270 ms, 40 mm/s take 40/acc to brake; but 160 to 250 ms in any case."""
    rig = mic(acc)
    assert rig.begin(Jog("a", 1, 40.0)).lasts_ns == lasts_ms * MILLISECOND


@pytest.mark.parametrize("acc", [20.0, 100.0, 400.0, 5000.0])
def test_a_mic488_whose_viewer_has_gone_brakes_at_once_and_stands_in_time(acc: float) -> None:
    rig = mic(acc)
    held = rig.begin(Jog("a", 1, 40.0))
    for _ in range(20):
        rig.run(50)
        held.extend()
    last = rig.world.now
    held.drop()
    rig.run(20)
    assert rig.position("a.M1.velocity") < 40.0
    rig.run(2000)
    assert rig.stands_at() <= last + 300 * MILLISECOND
    assert rig.position("a.M1_VMAX") == 40.0


def test_an_axis_that_is_let_go_has_its_whole_ramp() -> None:
    rig = mic(20.0)
    held = rig.begin(Jog("a", 1, 10.0))
    for _ in range(20):
        rig.run(50)
        held.extend()
    last = rig.world.now
    held.release()
    rig.run(2000)
    assert rig.stands_at() == pytest.approx(last + 500 * MILLISECOND, abs=5 * MILLISECOND)


def test_a_dead_man_jog_of_a_mic488_runs_evenly_and_goes_where_it_is_held() -> None:
    rig = mic(4000.0)
    held = rig.begin(Jog("a", 1, -40.0))
    rig.run(50)
    for _ in range(50):
        rig.run(80)
        held.extend()
        assert rig.position("a.M1.velocity") == -40.0
    held.release()
    rig.run(1000)
    assert held.over == "let go"
    # 4.05 s at 40 mm/s, with ramps of 10 ms at both ends
    assert rig.position("a.M1.position") == pytest.approx(-40.0 * 4.05, abs=0.05)


@pytest.mark.parametrize("ends", ["release", "lapse", "stop"])
def test_vmax_is_the_velocity_of_the_jog_only_while_it_lasts(ends: str) -> None:
    rig = mic()
    held = rig.begin(Jog("a", 1, 10.0))
    rig.run(60)
    assert rig.position("a.M1_VMAX") == 10.0
    if ends == "release":
        held.release()
    elif ends == "stop":
        rig.subject.do(StopAxes("a", 1))
        with pytest.raises(Refusal, match="has ended"):
            held.extend()
    rig.run(500)
    assert rig.position("a.M1_VMAX") == 40.0


def test_a_jog_uses_relative_moves_and_nothing_without_end() -> None:
    rig = mic()
    rig.followed.take()
    held = rig.begin(Jog("a", 1, 10.0))
    for _ in range(5):
        rig.run(80)
        held.extend()
    frames = (event.payload for event in rig.followed.take().events)
    requests = [one.data for one in frames if isinstance(one, FramePayload) and one.direction == "in"]
    written = {int.from_bytes(frame[2:4], "big") for frame in requests}
    named = {name: int(_address(rig, name)) for name in ("M1_POS_REL", "M1_VMAX", "M1_VEL_ABS")}
    assert {named["M1_POS_REL"], named["M1_VMAX"]} <= written
    assert named["M1_VEL_ABS"] not in written
    assert all(frame[1] != 5 for frame in requests)  # no coil


def _address(rig: Rig, name: str) -> Any:
    return rig.subject.description.controllers[0].datasheet.point(name).addresses[0].place


def test_a_jog_whose_first_request_is_still_on_its_way_is_extended() -> None:
    """The axis has been enabled long before, and its status becomes that of a move only when the request has arrived."""
    rig = mic(timing=TIMED)
    rig.run(5000)
    held = rig.begin(Jog("a", 1, 10.0))
    held.extend()
    rig.run(1)
    assert rig.position("a.M1.velocity") == 0
    held.extend()
    rig.run(60)
    assert rig.position("a.M1.velocity") > 0
    assert held.over is None


def test_who_stops_the_axis_otherwise_ends_the_jog() -> None:
    rig = mic()
    held = rig.begin(Jog("a", 1, 10.0))
    rig.run(80)
    held.extend()
    rig.run(40)
    rig.subject.do(do.Write((("a", "M1_STOP", 1.0),)))
    rig.run(40)
    with pytest.raises(Refusal, match="has ended"):
        held.extend()
    at = rig.position("a.M1.position")
    rig.run(1000)
    assert rig.position("a.M1.position") == at


def test_another_motion_is_not_stopped_by_a_jog_that_lapses() -> None:
    rig = mic()
    rig.begin(Jog("a", 1, 10.0))
    rig.run(80)
    rig.subject.do(Home("a", 1, -5.0))
    rig.run(1000)
    assert rig.position("a.M1.velocity") == -5.0


@pytest.mark.parametrize("velocity", [0.0, 40.5, -41.0])
def test_velocities_are_limited_to_vmax(velocity: float) -> None:
    with pytest.raises(Misuse, match=r"permitted are -40 to 40 mm/s \(VMAX\), but not 0"):
        mic().begin(Jog("a", 1, velocity))


def test_a_drive_that_is_off_is_not_jogged() -> None:
    rig = Rig(MIC.format(acc=100.0, timing=""))
    with pytest.raises(Refusal, match="not enabled"):
        rig.begin(Jog("a", 1, 5.0))
    with pytest.raises(Misuse, match="no axis 5"):
        rig.begin(Jog("a", 5, 5.0))


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((("a", "AXIS_CTR_MODE", 1.0),), r"a waits for triggers \(AXIS_CTR_MODE\), so an axis cannot be jogged"),
        ((("a", "PROGRAM_CTRL", 1.0),), "a runs its program: pause or stop it before an axis is jogged"),
    ],
)
def test_a_mic488_that_something_else_commands_is_not_jogged(values: tuple[tuple[str, str, float], ...], text: str) -> None:
    rig = Rig(MIC.format(acc=1000.0, timing="") + "\n")
    rig.world.mic488["a"].device.load_program(0, loaded("WAIT IN5 = ON\n")[0])
    rig.subject.do(Enable("a", 1))
    rig.subject.do(do.Write(values))
    rig.run(100)
    with pytest.raises(Refusal, match=text):
        rig.begin(Jog("a", 1, 10.0))
    assert rig.position("a.M1.velocity") == 0
    with pytest.raises(Misuse, match="a: no axis 5: a MIC488 has 1 to 4"):
        rig.begin(Jog("a", 5, 10.0))


def test_a_mic488_with_a_position_error_is_not_jogged() -> None:
    rig = mic()
    rig.world.mic488["a"].device.axes[0].status = AxisStatus.ERROR
    with pytest.raises(Refusal, match="a M1 has a position error: stop it first"):
        rig.begin(Jog("a", 1, 10.0))


def asked(held: Mic488DeadManJog, world: World) -> tuple[tuple[tuple[str, float], ...], ...]:
    """What it asks for with its first extension; the requests are carried out."""
    given = held.extend(world.now)
    return tuple(values(one) for one in given)


def values(one: object) -> tuple[tuple[str, float], ...]:
    assert isinstance(one, do.Write)
    return tuple((name, value) for _, name, value in one.values)


@pytest.mark.parametrize(
    ("acc", "velocity", "going", "way"),
    [
        # 5 pulses on the ramp, 240 at 10 mm/s, 5 to brake
        (1000.0, 10.0, 0.0, 2.5),
        (1000.0, -10.0, 0.0, -2.5),
        # 160 ms on the ramp up to 3.2 mm/s, and 160 ms to brake
        (20.0, 40.0, 0.0, 0.5 * 3.2 * 0.16 + 0.5 * 3.2 * 0.16),
        # It goes on from 10 mm/s, or turns first and is taken to begin at rest.
        (100.0, 40.0, 10.0, 0.5 * (10 + 26) * 0.16 + 0.5 * 26 * 0.26),
        (100.0, -40.0, 10.0, -(0.5 * 16 * 0.16 + 0.5 * 16 * 0.16)),
        (100.0, 10.0, 30.0, 10 * 0.17 + 0.5 * 10 * 0.1),
        # A pulse at least
        (5000.0, 0.001, 0.0, 0.01),
    ],
)
def test_how_far_a_move_of_a_dead_man_jog_goes(acc: float, velocity: float, going: float, way: float) -> None:
    rig = mic(acc)
    rig.world.mic488["a"].write("M1_VEL_ABS", going)
    rig.run(1000)
    held = Mic488DeadManJog(rig.world.mic488["a"].device, "bus", Jog("a", 1, velocity))
    assert (held.deadline(), held.advance(rig.world.now)) == (None, ())
    ((*first, (name, distance)),) = asked(held, rig.world)
    assert first == ([] if abs(velocity) == 40.0 else [("M1_VMAX", abs(velocity))])
    assert name == "M1_POS_REL"
    assert distance == pytest.approx(way, rel=1e-6)
    assert held.deadline() == rig.world.now + STOP_NS


def test_a_jog_of_a_mic488_that_is_let_go_before_it_moves_is_stopped_behind_its_move() -> None:
    """Its first move may still be on the line."""
    rig = mic()
    held = Mic488DeadManJog(rig.world.mic488["a"].device, "bus", Jog("a", 1, 10.0))
    held.extend(rig.world.now)
    assert held.release(rig.world.now) == (do.Write((("a", "M1_VEL_ABS", 0.0), ("a", "M1_VMAX", 40.0))),)
    assert (held.over, held.deadline(), held.release(rig.world.now)) == ("let go", rig.world.now + STOP_NS, ())
    assert held.advance(rig.world.now + STOP_NS) == ()
    assert held.deadline() is None


def test_a_jog_of_a_mic488_that_was_never_begun_has_nothing_to_stop() -> None:
    rig = mic()
    held = Mic488DeadManJog(rig.world.mic488["a"].device, "bus", Jog("a", 1, 10.0))
    assert held.release(rig.world.now) == (do.Write((("a", "M1_VMAX", 40.0),)),)
    assert (held.over, held.deadline()) == ("let go", None)


@pytest.mark.parametrize("ends", ["release", "drop"])
def test_what_a_moving_axis_is_told_at_the_end_of_a_jog(ends: str) -> None:
    rig = mic(20.0)
    rig.world.mic488["a"].write("M1_VEL_ABS", 10.0)
    rig.run(1000)
    held = Mic488DeadManJog(rig.world.mic488["a"].device, "bus", Jog("a", 1, 10.0))
    begun = rig.world.now
    for given in held.extend(begun):
        rig.world.apply_input(given)
    rig.run(50)
    now = rig.world.now
    assert rig.world.mic488["a"].device.axes[0].profile.moving(now)
    given = held.release(now) if ends == "release" else held.drop(now)
    assert given == (do.Write((("a", "M1_VEL_ABS", 0.0), ("a", "M1_VMAX", 40.0))),)
    # Who has let go may brake as long as it takes; who has gone has to stand in time.
    due = (now if ends == "release" else begun) + STOP_NS
    assert held.deadline() == due
    for one in given:
        rig.world.apply_input(one)
    assert held.advance(due - 1) == ()
    stop = (do.Write((("a", "M1_STOP", 1.0),)),) if ends == "drop" else ()
    assert held.advance(due) == stop
    assert (held.over, held.deadline()) == ("let go" if ends == "release" else "lapsed", None)


def test_a_jog_of_a_mic488_that_another_has_stopped_is_over() -> None:
    rig = mic()
    device = rig.world.mic488["a"].device
    held = Mic488DeadManJog(device, "bus", Jog("a", 1, 40.0))
    held.extend(rig.world.now)
    begun = rig.world.now
    # Its request has not arrived within 200 ms.
    rig.run(200)
    assert held.extend(begun + 200 * MILLISECOND) != ()
    assert held.extend(begun + 200 * MILLISECOND + 1) == ()
    assert held.over == f"a M1: {AXIS_STATUS_TEXTS[device.axes[0].status]}"
    assert (held.deadline(), held.extend(rig.world.now)) == (None, ())


def test_a_jog_that_is_over_asks_for_nothing_more() -> None:
    for rig, wanted in ((mic(), Jog("a", 1, 10.0)), (chip(), Jog("drum", 1, 6400.0))):
        held = rig.begin(wanted)
        rig.run(3000)
        assert held.over == "lapsed"
        assert rig.jogs.deadline() is None
        rig.followed.take()
        with pytest.raises(Refusal, match="the jog has ended: lapsed"):
            held.extend()
        rig.run(1000)
        assert [event for event in rig.followed.take().events if isinstance(event.payload, PlanPayload)] == []


def test_a_jog_that_is_cut_says_so_and_asks_for_nothing_more() -> None:
    of_mic, of_chip = mic(), chip()
    makers: list[tuple[Rig, Callable[[], Mic488DeadManJog | M1486DeadManJog]]] = [
        (of_mic, lambda: Mic488DeadManJog(of_mic.world.mic488["a"].device, "bus", Jog("a", 1, 10.0))),
        (of_chip, lambda: M1486DeadManJog(of_chip.world.m1486["drum"].chip, "chips", Jog("drum", 1, 6400.0))),
    ]
    for rig, make in makers:
        for begun in (False, True):
            held = make()
            if begun:
                held.extend(rig.world.now)
            held.cut()
            assert held.over == "stopped"
            assert held.extend(rig.world.now) == ()
            held.cut()
            assert held.over == "stopped"
        ended = make()
        ended.release(rig.world.now)
        ended.cut()
        assert ended.over == "let go"
