"""Followers of cam discs: places and switches against a count of every pulse by the test, which knows the motion of the axis."""

from __future__ import annotations

from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.components.follower import FOLLOWER
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 160.0
acc = 500.0
dec = 500.0
vel = 200.0
mot_resol = 3200
[[axis]]
name = "x"
drive = "a.M1"
pitch = 20.0
[[shaft]]
name = "main"
axis = "x"
ratio = 0.03
offset = 20.0
[[follower]]
name = "knife"
shaft = "main"
points = [[30, 0], [90, 12], [150, 12], [200, 0]]
[[follower.switch]]
above = 11.0
to = "a.IN3"
[[follower.switch]]
position = 6
width = 1
to = "a.IN4"
"""
RATE, SPEED = 500 * 160, 200 * 160
"""Pulses/s² and pulses/s."""


def lift(pulses: int) -> float:
    angle = (pulses / 160 * 0.03 * 360 + 20) % 360
    if 30 <= angle <= 90:
        return (angle - 30) / 5
    if 90 < angle <= 150:
        return 12.0
    return (200 - angle) * 12 / 50 if 150 < angle < 200 else 0.0


def moment(pulse: int) -> float:
    ramp = SPEED**2 / (2 * RATE)
    return (2 * pulse / RATE) ** 0.5 if pulse <= ramp else SPEED / RATE + (pulse - ramp) / SPEED


def start(world: World, to: float = 250.0) -> World:
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", to)
    return world


def edges(world: World, channel: str) -> list[tuple[float, object]]:
    return [(record.time / SECOND, record.value) for record in world.trace.edges() if record.subject == channel]


def counted(is_on: object, until: int) -> list[tuple[float, object]]:
    assert callable(is_on)
    level, found = bool(is_on(0)), []
    for pulse in range(1, until):
        if bool(is_on(pulse)) is not level:
            level = not level
            found.append((moment(pulse), float(level)))
    return found


def test_it_is_where_the_table_lifts_it() -> None:
    world = start(World.from_toml(TEXT))
    for _ in range(40):
        world.run(for_=0.0317)
        pulses = round(world.axis["x"].position * 160)
        assert world.read("knife.position") == pytest.approx(lift(pulses), abs=1e-9)


def test_its_switches_switch_at_the_pulse() -> None:
    world = start(World.from_toml(TEXT))
    world.run(until=1.2)
    for channel, is_on in (
        ("knife.switch1", lambda pulse: lift(pulse) >= 11.0 - 5e-7),
        ("knife.switch2", lambda pulse: 5.5 - 5e-7 <= lift(pulse) <= 6.5 + 5e-7),
    ):
        found = edges(world, channel)[1:]
        expected = [one for one in counted(is_on, 160 * 220) if one[0] < 1.2]
        assert len(found) == len(expected) >= 6
        for (time, level), (when, what) in zip(found, expected, strict=True):
            assert (time, level) == (pytest.approx(when, abs=2e-9), what)


@pytest.mark.parametrize("condition", ["knife.position > 11.99", "knife.position < 0.01 and time > 0.4", "knife.position >= 6"])
def test_conditions_see_it_in_the_first_nanosecond(condition: str) -> None:
    world = start(World.from_toml(TEXT))
    world.run(until=condition, for_=1)
    now = world.now
    before = start(World.from_toml(TEXT))
    before.run(until=(now - 1) / SECOND)
    assert before.now == now - 1
    assert world.holds(world.condition(condition))
    assert not before.holds(before.condition(condition))


def test_what_is_never_reached_is_not_waited_for_endlessly() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_VEL_ABS", 100.0)
    world.run(until="knife.position > 12.5", for_=3)
    assert world.time == 3.0
    assert len(edges(world, "knife.switch1")) > 10


def test_it_goes_backwards_and_with_a_shaft_that_turns_backwards() -> None:
    forward = start(World.from_toml(TEXT), 200.0)
    backward = start(World.from_toml(TEXT.replace("ratio = 0.03", "ratio = -0.03")), -200.0)
    for world in (forward, backward):
        world.run(until=2.0)
    assert edges(forward, "knife.switch1") == edges(backward, "knife.switch1")


def test_its_faults() -> None:
    stuck = start(World.from_toml(TEXT))
    stuck.run(until="knife.position > 5")
    place = stuck.read("knife.position")
    stuck.fault("stuck-follower element=knife name=stuck")
    stuck.run(for_=0.2)
    assert stuck.read("knife.position") == place
    stuck.clear_fault("stuck")
    assert stuck.read("knife.position") == pytest.approx(lift(round(stuck.axis["x"].position * 160)))
    worn = start(World.from_toml(TEXT))
    worn.fault("worn-cam element=knife share=0.5")
    worn.run(until=2.0)
    assert [level for _, level in edges(worn, "knife.switch1")] == [0.0], "6 mm at most"
    assert [level for _, level in edges(worn, "knife.switch2")][:3] == [0.0, 1.0, 0.0]


def test_a_turn_has_twice_as_many_pulses_as_its_cam_has_points() -> None:
    """4 points. 160 pulses per unit, and a turn in 1 / ratio units: 10 pulses, and 7."""
    assert World.from_toml(TEXT.replace("ratio = 0.03", "ratio = 16"))
    with pytest.raises(WorldError, match="too few for so many"):
        World.from_toml(TEXT.replace("ratio = 0.03", "ratio = 22"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('shaft = "main"', 'shaft = "mian"'), r"no shaft is called 'mian' \(did you mean 'main'\?\)"),
        (('shaft = "main"', 'shaft = "x"'), "no shaft is called 'x'"),
        (("points =", "point ="), r"\[follower\] has no 'point' \(did you mean 'points'\?\)"),
        (("[200, 0]", "[360, 0]"), "a cam has at least two, from 0 to below 360 degrees"),
        (("[30, 0], [90, 12], [150, 12], [200, 0]", "[30, 1]"), "1 angles: a cam has at least two"),
        (("[30, 0]", "[-1, 0]"), "4 angles: a cam has at least two, from 0 to below 360 degrees"),
        (("[30, 0]", "[30, -1]"), "lifts are counted from 0"),
        (("[90, 12]", "[20, 12]"), "the first numbers must grow"),
        (("above = 11.0", "abov = 11.0"), r"has no 'abov' \(did you mean 'above'\?\)"),
        (("width = 1\n", "width = 1\nperiod = 3\n"), "period = 3: a follower moves between two ends"),
        (("ratio = 0.03", "ratio = 30000"), "too few for so many"),
        (('to = "a.IN4"', 'to = "a.IN44"'), "IN44"),
    ],
)
def test_mistakes_have_their_places(change: tuple[str, str], message: str) -> None:
    assert change[0] in TEXT
    with pytest.raises(WorldError, match=f"(?s)w.toml:.*{message}"):
        World.from_toml(TEXT.replace(*change), name="w.toml")


@pytest.mark.parametrize("moment_s", [0.0, 0.11, 0.4, 0.55, 0.9, 2.0])
def test_it_can_be_restored_anywhere(moment_s: float, tmp_path: Path) -> None:
    found, other = World.from_toml(TEXT), World.from_toml(TEXT)
    start(found)
    found.fault("stuck-follower element=knife from_s=0.5 until_s=0.6")
    found.fault("worn-cam element=knife share=0.95 from_s=0.7")
    check_it_can_be_restored(found, other, moment_s, 3.0, tmp_path)
    assert len(edges(found, "knife.switch1")) > 4


def test_switches_of_a_stuck_follower_stay_as_they_are() -> None:
    """Also where its axis gets another plan."""
    world = start(World.from_toml(TEXT))
    world.run(until="knife.position > 11.5")
    world.fault("stuck-follower element=knife name=stuck")
    switched = edges(world, "knife.switch1")
    assert switched[-1][1] == 1
    world.run(for_=0.05)
    world.mic488["a"].write("M1_POS_ABS", 30.0)
    world.run(for_=3.0)
    assert lift(round(world.axis["x"].position * 160)) < 11.0
    assert edges(world, "knife.switch1") == switched
    now = world.now / SECOND
    world.clear_fault("stuck")
    world.sync_all()
    assert edges(world, "knife.switch1")[len(switched) :] == [(now, 0)]


def test_a_cam_that_wears_at_rest_changes_switches_at_once() -> None:
    world = start(World.from_toml(TEXT))
    world.run(until="knife.position > 11.5")
    world.mic488["a"].write("M1_STOP", 1)
    world.run(for_=0.1)
    now = world.now / SECOND
    world.fault("worn-cam element=knife share=0.5 name=worn")
    world.sync_all()
    assert edges(world, "knife.switch1")[-1] == (now, 0)
    world.clear_fault("worn")
    world.sync_all()
    assert edges(world, "knife.switch1")[-1] == (now, 1)


@pytest.mark.parametrize(
    ("share", "place"),
    [(1.0, 12_000_000_000), (0.5, 6_000_000_000), (0.3333333332, 3_999_999_998), (0.3333333333, 4_000_000_000)],
)
def test_its_place_is_the_nearest_also_where_its_cam_is_worn(share: float, place: int) -> None:
    """It stands at 12 mm. 12 · 0.3333333332 mm are 3999999998.4 pm, 12 · 0.3333333333 mm 3999999999.6 pm."""
    world = World.from_toml(TEXT.replace("offset = 20.0", "offset = 120.0"))
    world.fault(f"worn-cam element=knife share={share}")
    world.run(for_=0.1)
    assert world.objects.built(FOLLOWER)["knife"].grid_position(world.now) == place


@pytest.mark.parametrize(
    ("unit", "above", "pulse"), [("mm", 11.5, 1000), ("mm", 11.5002, 1001), ("m", 0.0115, 1000), ("m", 0.0115002, 1001)]
)
def test_a_switch_is_as_exact_in_any_unit(unit: str, above: float, pulse: int) -> None:
    """At the 1000th pulse its lift is 11.5 mm: 200 nm more are at the next one."""
    text = TEXT.replace("above = 11.0", f"above = {above}").replace("points", f'unit = "{unit}"\npoints')
    if unit == "m":
        text = text.replace("12]", "0.012]").replace("position = 6\nwidth = 1", "position = 0.006\nwidth = 0.001")
    world = start(World.from_toml(text))
    world.run(for_=2.0)
    assert edges(world, "knife.switch1")[1][0] == pytest.approx(moment(pulse), abs=1e-9)


def test_where_it_may_turn_is_after_the_present_moment() -> None:
    """Also a nanosecond before it comes to a corner of its cam."""
    world = start(World.from_toml(TEXT))
    world.run(for_=0.01)
    follower = world.objects.built(FOLLOWER)["knife"]
    turning_points = [*follower.turning_points(world.now)]
    assert len(turning_points) > 4
    for turn in turning_points:
        assert all(other > turn - 1 for other in follower.turning_points(turn - 1))
