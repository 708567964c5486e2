"""Shafts with cams: edges at the pulses at which a count of every pulse by the test has them."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.files.world import World
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
name = "cams"
axis = "x"
ratio = 0.03
offset = 20.0
[[shaft.cam]]
from = 90
until = 135
to = "a.IN1"
[[shaft.cam]]
from = 350
until = 15
to = "a.IN2"
contact = "NC"
"""


def edges(world: World, channel: str) -> list[tuple[int, object]]:
    return [(record.time, record.value) for record in world.trace.edges() if record.subject == channel]


def nearest(exact: Fraction) -> int:
    return (exact + Fraction(1, 2)).__floor__()


def run(text: str = TEXT, to: float = 150.0) -> World:
    world = World.from_toml(text)
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", to)
    world.run(until=3.0)
    return world


def angle(pulses: int, ratio: Fraction = Fraction(3, 100)) -> Fraction:
    return Fraction(pulses, 160) * ratio * 360 + 20


def moment(pulse: int) -> float:
    """Seconds: 500 mm/s² up to 200 mm/s, then that speed."""
    place = pulse / 160
    return (2 * place / 500) ** 0.5 if place <= 40 else 0.4 + (place - 40) / 200


def test_cams_come_in_every_turn() -> None:
    world = run(to=250.0)
    found = [(time / SECOND, level) for time, level in edges(world, "cams.switch1")[1:9]]
    # A turn is 5333⅓ pulses; the cam is from 90 to 135 degrees, 70 to 115 degrees from where it begins.
    turn = Fraction(16000, 3)
    ons = [nearest(Fraction(70, 360) * turn + n * turn) for n in range(4)]
    offs = [nearest(Fraction(115, 360) * turn + n * turn) + 1 for n in range(4)]
    assert [level for _, level in found] == [1.0, 0.0] * 4
    # The places of repeated zones are within half a pulse, both of its ends together.
    for (on, _), (off, _), first, last in zip(found[::2], found[1::2], ons, offs, strict=True):
        pulse = moment(first) - moment(first - 1)
        assert on == pytest.approx(moment(first), abs=1.01 * pulse)
        assert off == pytest.approx(moment(last), abs=1.01 * pulse)
    assert found[0][0] == pytest.approx(moment(ons[0]), abs=2e-9)


def test_a_cam_through_0_is_on_at_the_beginning_where_it_is_there() -> None:
    world = World.from_toml(TEXT.replace("offset = 20.0", "offset = 5.0"))
    world.run(until=0.1)
    assert (world.read("a.IN1"), world.read("a.IN2")) == (0, 0)
    other = World.from_toml(TEXT)
    other.run(until=0.1)
    assert other.read("a.IN2") == 1


@pytest.mark.parametrize(("ratio", "sign"), [("0.03", 1), ("-0.03", -1)])
def test_its_angle_is_a_signal(ratio: str, sign: int) -> None:
    world = World.from_toml(TEXT.replace("ratio = 0.03", f"ratio = {ratio}"))
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", 100.0)
    world.run(until=f"abs(cams.angle - 20) >= {Fraction(360, 4)}")
    assert world.now / SECOND == pytest.approx(moment(1334), abs=1e-8)
    assert world.read("cams.angle") == pytest.approx(float(angle(1334 * sign)), abs=1e-9)


def test_levels_are_those_of_the_angle() -> None:
    world = World.from_toml(TEXT)
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", 300.0)
    for n in range(1, 90):
        world.run(until=n * 0.0173)
        here = float(angle(round(world.axis["x"].position * 160))) % 360
        near = min(abs(here - edge) for edge in (90, 135, 350, 15))
        if near > 0.07:  # a pulse is 0.0675 degrees
            assert world.read("a.IN1") == float(90 < here < 135), n
            assert world.read("a.IN2") == float(not (here > 350 or here < 15)), n


SLIPS = '[[fault]]\nname = "slip"\nkind = "slipping-coupling"\nelement = "cams"\nfrom_s = 0.50001\nuntil_s = 0.60001\n'


def test_a_coupling_that_slips_costs_the_way_of_its_axis() -> None:
    whole, world = run(to=250.0), run(TEXT + SLIPS, to=250.0)
    # 0.1 s at 200 mm/s: 20 mm, which are 216 degrees of the shaft.
    assert float(whole.read("cams.angle")) - float(world.read("cams.angle")) == pytest.approx(216.0, abs=1e-9)
    before = [edge for edge in edges(whole, "cams.switch1") if edge[0] < 0.5 * SECOND]
    assert [edge for edge in edges(world, "cams.switch1") if edge[0] < 0.5 * SECOND] == before != []
    # From 0.6 s on what comes is what comes without the fault, 0.1 s later: the velocity is the same until 1.25 s.
    late = [(time + SECOND // 10, level) for time, level in edges(whole, "cams.switch1") if 0.5 < time / SECOND < 1.14]
    found = [edge for edge in edges(world, "cams.switch1") if 0.6 < edge[0] / SECOND < 1.24]
    assert [level for _, level in found] == [level for _, level in late] != []
    assert [time for time, _ in found] == pytest.approx([time for time, _ in late], abs=1)


def test_a_shaft_stands_while_its_coupling_slips() -> None:
    world = World.from_toml(TEXT + SLIPS.replace("until_s = 0.60001\n", ""))
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", 250.0)
    world.run(until=0.50001)
    angle_then = world.read("cams.angle")
    world.run(until=3.0)
    assert world.read("cams.angle") == angle_then != 20.0
    assert [edge for edge in edges(world, "cams.switch1") if edge[0] > 0.5 * SECOND] == []


def test_its_coupling_tells_how_far_it_slipped() -> None:
    world = run(TEXT + SLIPS, to=250.0)
    told = [record.value for record in world.trace if record.kind == "fault"]
    assert told == ["the coupling of cams slips", "the coupling of cams grips, 216 degrees behind"]


@pytest.mark.parametrize("moment_s", [0.45, 0.55, 0.65])
def test_a_slipping_coupling_is_restored(moment_s: float) -> None:
    text = TEXT + SLIPS
    world = World.from_toml(text)
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_POS_ABS", 250.0)
    world.run(until=moment_s)
    snapshot = world.snapshot()
    world.run(until=3.0)
    other = World.from_toml(text)
    other.restore(snapshot)
    other.run(until=3.0)
    assert other.trace.digest() == world.trace.digest()
    assert other.read("cams.angle") == world.read("cams.angle")


@pytest.mark.parametrize("moment_s", [0.0, 0.2, 0.7, 1.1])
def test_snapshots_and_sessions_have_it(moment_s: float, tmp_path: Path) -> None:
    text = TEXT + '[[script]]\nname = "s"\nsteps = [{ write = { "a.M1_EN" = 1, "a.M1_POS_ABS" = 150.0 } }, { until = "a.IN1" }]\n'
    check_it_can_be_restored(World.from_toml(text), World.from_toml(text), moment_s, 2.0, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("ratio = 0.03", "ratio = 0", "t.toml:18.*permitted are numbers other than 0"),
        ("ratio = 0.03", "ratoi = 0.03", r"has no 'ratoi' \(did you mean 'ratio'\?\)"),
        ('axis = "x"', 'axis = "y"', "no axis is called 'y'"),
        ("until = 135", "until = 90", "t.toml:22.*the cam has no width"),
        ("until = 135", "until = 400", "permitted are numbers from 0 to 360"),
        ("until = 135", "until = 135\nbounces = 3", "t.toml:23.*bounces means nothing without bounce"),
        ('to = "a.IN2"', 'to = "a.IN1"', "a.IN1 is driven already"),
        ("from = 90\nuntil = 135", "from = 0\nuntil = 360", "it must be shorter"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"(?s){text}"):
        World.from_toml(TEXT.replace(old, new, 1), name="t.toml")
