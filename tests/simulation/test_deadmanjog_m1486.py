"""As test_deadmanjog_mic488, of chips."""

from __future__ import annotations

import pytest
from deadmanjog_rig import TIMED, Rig, chip

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.m1486.drive import speed_curve
from steptwin.motion.ramps import plan_distance
from steptwin.simulation.kinds.m1486.deadmanjog import M1486DeadManJog
from steptwin.simulation.script import steps as do
from steptwin.subject.commands import Jog, StopAxes

SLOW = f"{TIMED}\nbaud = 1200"


@pytest.mark.parametrize("timing", ["", TIMED, SLOW])
@pytest.mark.parametrize("velocity", [64.0 * 20, 64.0 * 640, -64.0 * 4000])
@pytest.mark.parametrize("renewals", [0, 1, 7])
def test_an_m1486_stands_in_time_after_the_last_renewal(velocity: float, renewals: int, timing: str) -> None:
    rig = chip(timing=timing)
    rig.run(100)
    held = rig.begin(Jog("drum", 1, velocity))
    for _ in range(renewals):
        rig.run(held.lasts_ns / MILLISECOND / 3)
        held.extend()
    last = rig.world.now
    rig.run(2000)
    assert rig.stands_at() <= last + 300 * MILLISECOND
    assert rig.position("drum.position") * velocity > 0
    assert held.over == "lapsed"
    assert rig.jogs.deadline() is None


def test_a_jog_of_an_m1486_is_a_row_of_moves_without_any_that_never_ends() -> None:
    rig = chip()
    held = rig.begin(Jog("drum", 1, -64.0 * 640))
    for _ in range(10):
        rig.run(60)
        held.extend()
    held.release()
    rig.run(1000)
    commands = rig.sent().split("\r")
    assert commands[:2] == ["x7", "v640"]
    assert commands.count("r") >= 5
    assert {one[0] for one in commands if one} == {"x", "v", "b", "r"}
    assert commands[-2] == "v1000"  # as before: the default
    assert rig.position("drum.counter") == (rig.position("drum.position") % 2**24)


def test_an_m1486_that_was_killed_is_not_jogged_on() -> None:
    rig = chip()
    held = rig.begin(Jog("drum", 1, 64.0 * 640))
    rig.run(30)
    rig.subject.do(StopAxes("drum"))
    for _ in range(30):
        rig.run(80)
        if held.over is None:
            try:
                held.extend()
            except Refusal:
                break
    assert held.over is not None
    assert rig.sent().count("r\r") == 1


def test_what_cannot_be_jogged_is_refused() -> None:
    with pytest.raises(Refusal, match="EEPROM"):
        chip("E1").begin(Jog("drum", 1, 6400.0))
    with pytest.raises(Refusal, match="drum: a jog needs a line of at least 1200 bit/s; this one has 300 bit/s"):
        chip(timing=f"{TIMED}\nbaud = 300").begin(Jog("drum", 1, 6400.0))
    rig = chip()
    rig.subject.do(Jog("drum", 1, 6400.0))
    rig.run(50)
    with pytest.raises(Refusal, match="not at rest"):
        rig.begin(Jog("drum", 1, 6400.0))
    with pytest.raises(Misuse, match="drum: no axis 2: an M1486 has one, 1"):
        chip().begin(Jog("drum", 2, 6400.0))
    with pytest.raises(Misuse, match=r"velocity 1\.28006e\+06 min\. microsteps/s, V20001: "):
        chip().begin(Jog("drum", 1, 20001 * 64.0))
    with pytest.raises(Refusal, match="drum is on no line, so no commands can be sent to it"):
        Rig('[[m1486]]\nname = "drum"\n').begin(Jog("drum", 1, 6400.0))


@pytest.mark.parametrize(
    ("variant", "velocity", "microsteps"),
    [
        # Within 100 ms: what fits with the ramps, but one full step at least; a chip at 24 MHz is twice as fast.
        ("A", 16.0, 64),
        ("A2x", 32.0, 3 * 64),
    ],
)
def test_a_slow_jog_of_an_m1486_makes_whole_steps(variant: str, velocity: float, microsteps: int) -> None:
    rig = chip(variant)
    held = rig.begin(Jog("drum", 1, 64.0 * velocity))
    rig.run(50)
    held.release()
    rig.run(1000)
    assert [one for one in rig.sent().split("\r") if one[:1] in ("v", "f")] == ["v16", f"f{microsteps}", "v1000"]


def test_a_jog_of_an_m1486_begins_with_its_first_extension() -> None:
    rig = chip()
    wanted = Jog("drum", 1, 6400.0)
    held = M1486DeadManJog(rig.world.m1486["drum"].chip, "chips", wanted)
    assert (held.deadline(), held.advance(rig.world.now)) == (None, ())
    assert held.extend(rig.world.now) == (do.Send("chips", b"x7\rv100\rf640\rr\r"),)


@pytest.mark.parametrize("variant", ["A", "A2x"])
@pytest.mark.parametrize("velocity", [33, 100, 640, 1999, 5000])
def test_a_move_of_a_dead_man_jog_of_an_m1486_is_the_longest_that_ends_in_time(variant: str, velocity: int) -> None:
    """100 ms: with one microstep more it would take longer."""
    rig = chip(variant)
    unit = 64 * rig.world.m1486["drum"].chip.variant.clock
    held = M1486DeadManJog(rig.world.m1486["drum"].chip, "chips", Jog("drum", 1, float(unit * velocity)))
    (given,) = held.extend(rig.world.now)
    assert isinstance(given, do.Send)
    _, _, text, _, _ = given.data.decode().split("\r")
    drive = rig.world.m1486["drum"].chip.drive
    curve = speed_curve(
        (drive.start_stop, drive.acceleration, drive.profile_speed, velocity),
        drive.qualification,
        rig.world.m1486["drum"].chip.variant.clock,
    )
    longest, longer = (plan_distance(0, 0, int(text[1:]) + more, curve).end or 0 for more in (0, drive.grid_u))
    assert longest <= 100 * MILLISECOND < longer


def test_a_jog_of_an_m1486_lapses_in_its_last_nanosecond() -> None:
    rig = chip()
    held = M1486DeadManJog(rig.world.m1486["drum"].chip, "chips", Jog("drum", 1, -6400.0))
    begun = rig.world.now
    held.extend(begun)
    assert held.deadline() == begun + MILLISECOND
    drive = rig.world.m1486["drum"].chip.drive
    held._target_u = drive.true_u(begun)  # as if it had moved
    assert held.advance(begun + held.lasts_ns) != ()
    assert held.over is None
    held._target_u = drive.true_u(begun)
    assert held.advance(begun + held.lasts_ns + 1) == (do.Send("chips", b"x7\rv1000\r"),)
    assert (held.over, held.deadline()) == ("lapsed", None)


def test_a_chip_that_does_something_else_for_two_seconds_ends_its_jog() -> None:
    rig = chip()
    held = M1486DeadManJog(rig.world.m1486["drum"].chip, "chips", Jog("drum", 1, 6400.0))
    begun = rig.world.now
    held.extend(begun)
    rig.subject.do(Jog("drum", 1, 64.0 * 640))
    rig.run(100)
    assert held.advance(begun + 2 * SECOND) == ()
    assert (held.over, held.deadline()) == (None, begun + 2 * SECOND + MILLISECOND)
    assert held.advance(begun + 2 * SECOND + 1) == ()
    assert held.over is not None
    assert held.over.startswith("the chip ")
    assert held.deadline() is None
