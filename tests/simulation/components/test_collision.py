"""Collisions and forbidden zones: their moments against positions that the test integrates itself, in two controllers."""

from __future__ import annotations

from pathlib import Path

import pytest
from space_rig import POST, SLIDE, head
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[mic488]]
name = "a"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 100.0
dec = 100.0
vel = 50.0
mot_resol = 3200
[[mic488]]
name = "b"
[mic488.M1]
unit = "mm"
gear = 320.0
acc = 40.0
dec = 40.0
vel = 80.0
mot_resol = 3200
[[axis]]
name = "left"
drive = "a.M1"
pitch = 5.0
[[axis]]
name = "right"
drive = "b.M1"
pitch = 10.0
inverted = true
start = 300.0
[[collision]]
name = "carriages"
when = "left.position + 42.5 >= right.position"
effect = "jam"
reset = "a.OUT3"
[[wire]]
from = "carriages.hit"
to = "a.IN1"
"""


def travelled(seconds: float, acceleration: float, speed: float) -> float:
    """Millimetres from rest, up to a constant speed."""
    ramp = min(seconds, speed / acceleration)
    return acceleration * ramp * ramp / 2 + speed * (seconds - ramp)


def meeting(gap: float) -> float:
    """Seconds until both have used up the gap, by halving."""
    low, high = 0.0, 20.0
    for _ in range(60):
        middle = (low + high) / 2
        if travelled(middle, 100.0, 50.0) + travelled(middle, 40.0, 80.0) < gap:
            low = middle
        else:
            high = middle
    return high


def start(world: World) -> None:
    for name in ("a", "b"):
        world.mic488[name].write("M1_EN", 1)
        world.mic488[name].write("M1_POS_ABS", 300.0)


def hits(world: World) -> list[tuple[float, str]]:
    return [(record.time / SECOND, str(record.value)) for record in world.trace.of("event") if record.subject == "collision"]


def test_carriages_of_two_controllers_meet_at_the_exact_moment() -> None:
    world = World.from_toml(TEXT)
    start(world)
    world.run(until="carriages.hit")
    # Positions are whole pulses: a pulse of 1/640 and one of 1/320 mm may be lacking, at 130 mm/s.
    assert world.now / SECOND == pytest.approx(meeting(300.0 - 42.5), abs=0.0047 / 130)
    assert world.axis["left"].position + 42.5 >= world.axis["right"].position
    moment = world.now
    before = World.from_toml(TEXT)
    start(before)
    before.run(until=(moment - 1) / SECOND)
    assert before.now == moment - 1
    assert before.axis["left"].position + 42.5 < before.axis["right"].position
    assert world.read("a.IN1") == 1


def test_what_jams_stands_until_it_is_reset() -> None:
    world = World.from_toml(TEXT)
    start(world)
    world.run(until=10.0)
    left, right = world.axis["left"], world.axis["right"]
    stood = left.position, right.position
    assert left.position + 42.5 == pytest.approx(right.position, abs=0.01)
    assert world.mic488["a"].axis[1].position == 300.0
    assert left.lost == round((300.0 - left.position) * 640)
    world.mic488["a"].write("OUT3", 1)
    world.mic488["a"].write("M1_POS_ABS", 250.0)
    world.run(until=14.0)
    assert left.position == pytest.approx(stood[0] - 50.0, abs=0.06)
    assert [text for _, text in hits(world)] == ["carriages: left and right touch", "carriages: apart again"]
    assert world.read("carriages.count") == 1


def test_a_forbidden_zone_is_reported() -> None:
    more = """
    [[collision]]
    name = "table"
    when = "left.position > 6 cm and right.position < 25 cm"
    """
    world = World.from_toml(TEXT.replace("42.5", "0.5") + more)
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", 100.0)
    world.run(until=5.0)
    world.mic488["b"].write("M1_EN", 1)
    world.mic488["b"].write("M1_POS_ABS", 200.0)
    world.run(until=9.0)
    world.mic488["a"].write("M1_POS_ABS", 20.0)
    world.run(until=14.0)
    first, last = hits(world)
    # 50 mm of the way after √(2·50/40) s, and a pulse.
    assert first == (pytest.approx(5.0 + (2 * (50 + 1 / 320) / 40) ** 0.5, abs=2e-8), "table: left and right touch")
    # 40 mm back: 0.5 s to 12.5 mm, then 50 mm/s.
    assert last == (pytest.approx(9.0 + 0.5 + 27.5 / 50, abs=2e-8), "table: apart again")
    assert world.axis["left"].lost == world.axis["right"].lost == 0


def test_a_gantry_has_a_limit_of_skew() -> None:
    text = TEXT.replace('when = "left.position + 42.5 >= right.position"', 'when = "abs(left.position - right.position) > 0.5"')
    text = text.replace("inverted = true\nstart = 300.0\n", "").replace("= 40.0", "= 100.0").replace("vel = 80.0", "vel = 50.0")
    world = World.from_toml(text)
    start(world)
    world.run(until=2.0)
    assert hits(world) == []
    world.fault("stall machine=b at_s=0.5 for_s=0.001")
    world.run(until=3.0)
    assert hits(world) == []  # 0.05 mm behind, and caught where its angle fits
    world.fault("stall machine=b at_s=0.5 for_s=2")
    world.run(until=6.0)
    # 0.5 mm at 50 mm/s, less what was lost before.
    assert hits(world)[0][0] == pytest.approx(3.51, abs=0.002)
    assert abs(world.axis["left"].position - world.axis["right"].position) == pytest.approx(0.5, abs=0.11)


@pytest.mark.parametrize("moment_s", [0.0, 1.0, 3.2, 4.1, 8.0])
def test_snapshots_and_sessions_have_it(moment_s: float, tmp_path: Path) -> None:
    text = TEXT + (
        '[[script]]\nname = "s"\nsteps = [{ write = { "a.M1_EN" = 1, "b.M1_EN" = 1, "a.M1_POS_ABS" = 200.0 } },'
        '{ write = { "b.M1_POS_ABS" = 200.0 } }, { until = "a.IN1" }, { wait = "1 s" }, { write = { "a.OUT3" = 1 } },'
        '{ write = { "a.M1_POS_ABS" = 20.0 } }]\n'
    )
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), moment_s, 9.0, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('effect = "jam"', 'effect = "jamm"', r"t.toml:33.*'jamm' \(did you mean 'jam'\?\): permitted are report, jam"),
        ("left.position + 42.5", "left.position + ", "t.toml:32.*expected a signal or a number"),
        ("left.position + 42.5", "lft.position + 42.5", r"nothing is called 'lft' \(did you mean 'left'\?\)"),
        ("left.position + 42.5", "left.positon + 42.5", r"no signal 'left.positon' \(did you mean 'position'\?\)"),
        ("42.5", "42.5 s", "42.5 s is compared with 'mm'"),
        ("when", "if", "has no 'if'"),
        ('reset = "a.OUT3"', 'reset = "a.IN3"', "a.IN3 is not an output"),
        ("left.position + 42.5 >= right.position", "a.OUT3", "effect = 'jam': 'a.OUT3' names no axis, and nothing that an axis"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"(?s){text}"):
        World.from_toml(TEXT.replace(old, new, 1), name="t.toml")


def test_a_restored_snapshot_of_another_past_has_its_own_moment() -> None:
    """The cylinder has been sent once in both pasts."""
    cylinder = '[[cylinder]]\nname = "arm"\nextend = "a.OUT1"\nstroke = 100.0\n'
    cylinder += "extend_time = 0.5\nretract_time = 0.5\nswitching = 0\n"
    world = World.from_toml(f'[[mic488]]\nname = "a"\n{cylinder}[[collision]]\nname = "zone"\nwhen = "arm.position >= 60"')

    def sent_at(seconds: float) -> None:
        world.run(until=seconds)
        world.mic488["a"].write("OUT1", 1)
        world.run(until=0.3)

    begin = world.snapshot()
    sent_at(0.1)
    early = world.snapshot()
    world.restore(begin)
    sent_at(0.2)
    world.restore(early)
    world.run(until=1.0)
    assert hits(world) == [(0.4, "zone: parts touch")]


def test_a_controller_with_the_name_of_a_signal_is_no_quantity() -> None:
    text = TEXT.replace("left.position + 42.5", "idle + 42.5")
    with pytest.raises(WorldError, match="when: 'idle' is not a quantity of a controller or an element"):
        World.from_toml(f'[[mic488]]\nname = "idle"\n{text}')


# ---------------------------------------------------------------------- bodies in space


BODIES = (
    SLIDE
    + """
[[cylinder]]
name = "z"
extend = "a.OUT1"
stroke = 100.0
extend_time = "250 ms"
on = "x"
along = "-z"
"""
    + head("z")
    + POST
    + """
[[body]]
name = "bench"
at = [0, 0, 350]
size = [1000, 300, 20]
"""
)
JAMS = """
[[collision]]
name = "crash"
between = ["x", "post"]
effect = "jam"
reset = "a.OUT2"
"""


def lowered(text: str, target: float = 400.0, after: float = 0.0) -> World:
    """It moves to the target, and lowers its head then."""
    world = World.from_toml(text)
    view = world.mic488["a"]
    view.write("M1_EN", 1)
    view.write("M1_POS_ABS", target)
    world.run(until=after)
    view.write("OUT1", 1)
    return world


def test_bodies_touch_at_the_exact_moment() -> None:
    """The head, 40 mm long, comes to the post, 20 mm long, at 170 mm; they touch where they overlap by half a nanometre."""
    world = lowered(BODIES + JAMS)
    world.run(until=20.0)
    (touch,) = [record for record in world.trace.of("event") if record.subject == "collision"]
    assert touch.value == "crash: head and post touch"
    # 12.5 mm in 0.5 s, then 50 mm/s.
    assert touch.time == pytest.approx((0.5 + (170.0 - 12.5) / 50.0) * SECOND + 0.5e-6 / 50.0 * SECOND, abs=2)
    assert world.axis["x"].position == 170.0
    assert world.axis["x"].lost == (230 * 640)
    assert world.read("crash.hit") == 1


def test_what_is_above_a_body_goes_past_it() -> None:
    world = lowered(BODIES + JAMS, after=10.0)
    world.run(until=12.0)
    assert not hits(world)
    assert world.axis["x"].position == 400.0


def test_a_cylinder_stands_on_what_it_meets_and_goes_on_when_it_is_reset() -> None:
    """Its head comes to the bench, 370 mm high, after 100 mm; it is 500 mm up and 30 mm high: 0.25 s · 100/100."""
    text = BODIES.replace("at = [0, 0, 350]", "at = [0, 0, 370]") + JAMS.replace('["x", "post"]', '["head", "bench"]')
    world = lowered(text, target=20.0, after=3.0)
    world.run(until=5.0)
    ((moment, what),) = hits(world)
    assert (what, moment) == ("crash: head and bench touch", pytest.approx(3.0 + 0.25 * 80 / 100, abs=1e-8))
    assert world.read("z.position") == pytest.approx(80.0, abs=1e-5)
    assert world.read("z.extended") == world.read("z.retracted") == 0
    world.mic488["a"].write("OUT1", 0)
    world.run(until=6.0)
    assert world.read("z.position") == pytest.approx(80.0, abs=1e-5)  # it jams until it is reset
    world.mic488["a"].write("OUT2", 1)
    world.run(until=7.0)
    assert world.read("z.retracted") == 1
    assert [text for _, text in hits(world)][1:] == ["crash: apart again"]


def test_all_bodies_but_some_are_compared() -> None:
    every = '[[collision]]\nname = "crash"\nall = true\n'
    world = lowered(BODIES.replace("at = [0, 0, 350]", "at = [0, 0, 351]") + every)
    world.run(until=10.0)
    assert [text for _, text in hits(world)] == ["crash: head and bench touch", "crash: head and post touch"]
    assert world.read("crash.count") == 2
    world = lowered(BODIES.replace("at = [0, 0, 350]", "at = [0, 0, 351]") + every + 'except = [["x", "bench"]]\n')
    world.run(until=10.0)
    assert [text for _, text in hits(world)] == ["crash: head and post touch", "crash: apart again"]


def test_a_body_is_only_there_while_its_condition_holds() -> None:
    """A post that is put there while the head is within it, and taken away before the head is out."""
    text = BODIES.replace('name = "post"', 'name = "post"\nwhen = "time > 4 and time < 4.5"') + JAMS.replace("jam", "report")
    world = lowered(text)
    world.run(until=10.0)
    assert hits(world) == [(4.000000001, "crash: head and post touch"), (4.5, "crash: apart again")]


BELOW = """
[[integrator]]
name = "dip"
rate = "a.OUT1"
at = [500, 0, 0]
[[body]]
name = "pen"
on = "dip"
size = [1, 1, 1]
[[collision]]
name = "c"
between = ["pen", "post"]
effect = "jam"
"""


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        ('[[collision]]\nname = "c"', "a collision needs one of when, between and all"),
        ('[[collision]]\nname = "c"\nbetween = ["x", "post"]\nall = true', "between and all exclude each other"),
        ('[[collision]]\nname = "c"\nbetween = ["x"]', "expected a list of at least two names"),
        ('[[collision]]\nname = "c"\nbetween = ["x", "pots"]', "nothing is called 'pots' (did you mean 'post'?)"),
        (
            '[[body]]\nname = "hat"\non = "z"\nsize = [1, 1, 1]\n[[collision]]\nname = "c"\nbetween = ["head", "hat"]',
            "nothing moves these bodies against each other",
        ),
        (
            '[[collision]]\nname = "c"\nbetween = ["y", "post"]\n[[axis]]\nname = "y"\ndrive = "a.M2"\npitch = 5.0\nalong = "+y"',
            "'y' is no [[body]], and carries none",
        ),
        (
            '[[body]]\nname = "wall"\nat = [0, 0, 480]\nsize = [10, 10, 10]\n[[collision]]\nname = "c"\nall = true',
            "'head' and 'wall' overlap when the world begins",
        ),
        (
            BELOW,
            "effect = 'jam': post and pen are moved against each other by dip, which nothing stops",
        ),
    ],
)
def test_what_cannot_be_compared_is_refused(more: str, problem: str) -> None:
    with pytest.raises(WorldError) as error:
        World.from_toml(BODIES + more)
    assert problem in str(error.value)


def test_contacts_of_bodies_can_be_restored(tmp_path: Path) -> None:
    check_it_can_be_restored(lowered(BODIES + JAMS), World.from_toml(BODIES + JAMS), 3.0, 8.0, tmp_path)


TWO = """
[[mic488]]
name = "c"
[[mic488]]
name = "d"
[[body]]
name = "plate"
at = [0, 0, -20]
size = [500, 500, 20]
[[cylinder]]
name = "x"
extend = "c.OUT1"
stroke = 60
on = "plate"
at = [0, 0, 20]
[[body]]
name = "h1"
on = "x"
size = [10, 10, 10]
[[cylinder]]
name = "y"
extend = "d.OUT1"
stroke = 60
on = "plate"
at = [0, 100, 20]
[[body]]
name = "h2"
on = "y"
size = [10, 10, 10]
[[body]]
name = "post"
at = [50, 100, 0]
size = [10, 10, 10]
[[collision]]
name = "k"
between = ["plate", "post"]
[[beam]]
name = "b"
sees = ["plate"]
at = [30, 80, 5]
along = "+y"
length = 40
"""


def test_what_stands_on_a_body_of_the_floor_shares_a_scheduler_with_what_compares_it() -> None:
    """Two controllers that nothing else joins."""
    world = World.from_toml(TWO)
    assert len(world.schedulers) == 1
    world.run(until=0.5)
    world.mic488["d"].write("OUT1", 1)
    world.run(until=2.0)
    assert world.read("k.count") == 1
    assert [one.value for one in world.trace.edges() if one.subject == "b.seen"] == [0.0, 1.0, 0.0]


CARRIED = """
[[mic488]]
name = "c"
[[cylinder]]
name = "lift"
extend = "c.OUT1"
stroke = 60
extend_time = "100 ms"
at = [0, 0, 199]
along = "-z"
[[vacuum]]
name = "cup"
ejector = "c.OUT2"
on = "lift"
[[nest]]
name = "tray"
at = [0, 0, 120]
workpiece = [40, 40, 20]
filled = 1
[[cylinder]]
name = "push"
extend = "c.OUT3"
stroke = 100
extend_time = "100 ms"
at = [-100, 0, 0]
[[body]]
name = "ram"
on = "push"
at = [0, 0, 160]
size = [40, 40, 40]
[[body]]
name = "rack"
at = [35, 0, 170]
size = [40, 40, 20]
"""


def carrying(more: str, ram: str = "") -> World:
    """The cup has lifted a workpiece of 40 mm to 200 mm above the floor."""
    world = World.from_toml(CARRIED.replace('name = "ram"', f'name = "ram"\n{ram}') + more)
    for register, value in (("OUT1", 1), ("OUT2", 1), ("OUT1", 0)):
        world.mic488["c"].write(register, value)
        world.run(for_=0.4)
    return world


@pytest.mark.parametrize(("ram", "stands"), [("", True), ('when = "c.OUT4"', True)])
def test_a_part_that_is_driven_into_what_is_carried_stands(ram: str, stands: bool) -> None:
    """The ram, 40 mm long, starts 100 mm before: they touch after 60 mm."""
    jam = '[[collision]]\nname = "k"\nbetween = ["cup", "ram"]\neffect = "jam"\n'
    world = carrying(jam, ram)
    world.mic488["c"].write("OUT4", 1)
    world.mic488["c"].write("OUT3", 1)
    world.run(for_=1.0)
    assert [text for _, text in hits(world)] == ["k: tray.1 and ram touch"]
    assert world.read("push.position") == pytest.approx(60.0, abs=0.001)


def test_a_body_that_is_not_there_touches_no_workpiece() -> None:
    world = carrying('[[collision]]\nname = "k"\nbetween = ["workpieces", "ram"]\n', 'when = "c.OUT4"')
    world.mic488["c"].write("OUT3", 1)
    world.run(for_=1.0)
    assert world.read("k.count") == 0
    world.mic488["c"].write("OUT4", 1)
    world.run(for_=0.1)
    assert world.read("k.count") == 1


def test_what_carries_a_workpiece_against_a_fixed_part_stands() -> None:
    """The workpiece, 40 mm wide, is lifted along the rack, 5 mm into it: its top comes to 170 mm after 30 mm."""
    jam = '[[collision]]\nname = "k"\nbetween = ["workpieces", "rack"]\neffect = "jam"\n'
    world = carrying(jam)
    assert [text for _, text in hits(world)] == ["k: tray.1 and rack touch"]
    assert world.read("lift.position") == pytest.approx(29.0, abs=0.001)


def test_pairs_are_left_out_by_any_name() -> None:
    apart = '[[collision]]\nname = "k"\nbetween = ["workpieces", "rack", "ram"]\nexcept = [["workpieces", "rack"]]\n'
    world = carrying(apart)
    world.mic488["c"].write("OUT3", 1)
    world.run(for_=1.0)
    assert [text for _, text in hits(world)] == ["k: tray.1 and ram touch", "k: ram and rack touch"]
