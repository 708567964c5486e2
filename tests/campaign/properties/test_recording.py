"""Values of comparisons beside what is read at each moment: programs that calculate ahead, several schedulers, several
motions."""

from __future__ import annotations

from pathlib import Path

import pytest
from slides import slide

from steptwin.campaign.properties import Verdict, read_property
from steptwin.files.world import World
from steptwin.motion import Profile
from steptwin.simulation.mechanics.trajectory import Trajectory

TWO = slide("left", "left_x") + slide("right", "right_x", ramps=120.0, vel=80.0)
JOINED = '\n[[wire]]\nfrom = "left.OUT8"\nto = "right.IN8"\n'
CALCULATES = """$I0 = 0
WHILE $I0 < 200
    $I0 = $I0 + 1
ENDWHILE
OUT3 = ON
WHILE $I0 < 300
    $I0 = $I0 + 1
ENDWHILE
"""


def moved(text: str, *, joined: bool) -> tuple[Verdict, list[tuple[float, float]]]:
    """The verdict on two axes that move with other ramps, and their places every 0.1 ms."""
    world = World.from_toml(TWO + (JOINED if joined else ""))
    assert len(world.schedulers) == (1 if joined else 2)
    watch = read_property(text).watch(world)
    for name in ("left", "right"):
        world.mic488[name].axis[1].enable()
        world.mic488[name].axis[1].move_to(100.0)
    places: list[tuple[float, float]] = []
    for _ in range(24):
        before = world.now
        for step in range(1000):
            moment = before + step * 100_000
            places.append((world.axes["left_x"].units(world.axes["left_x"].mechanism.grid_position(moment)), 0.0))
            places[-1] = places[-1][0], world.axes["right_x"].units(world.axes["right_x"].mechanism.grid_position(moment))
        world.run(for_=0.1)
    return watch.verdict(), places


@pytest.mark.parametrize("joined", [True, False])
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("always left_x.position - right_x.position < 30", lambda a, b: (30.0 - (a - b)) / 200.0),
        ("always right_x.position < left_x.position + 7", lambda a, b: (a + 7.0 - b) / 200.0),
        ("never abs(left_x.position - right_x.position) > 40", lambda a, b: (40.0 - abs(a - b)) / 200.0),
        ("always abs(left_x.position - 60) > 5", lambda a, b: (abs(a - 60.0) - 5.0) / 200.0),
    ],
)
def test_the_extreme_over_two_motions_is_that_of_all_moments(joined: bool, text: str, value: object) -> None:
    verdict, places = moved(text, joined=joined)
    least = min(value(*one) for one in places)  # type: ignore[operator]
    assert verdict.robustness == pytest.approx(least, abs=2e-5)  # 0.1 ms at 80 mm/s is 4e-5 of 200 mm, near the top far less
    assert verdict.holds is (least > 0.0)


@pytest.mark.parametrize("condition", ["left.OUT3", "left.USER_REGISTER[0]:int > 100", "left.USER_REGISTER[0]:int > 250"])
def test_what_a_program_calculates_ahead_is_seen_where_it_happens(tmp_path: Path, condition: str) -> None:
    """A register changes inside of the program, an output outside of it: both have the moment that a run until then has."""
    (tmp_path / "counts.prg").write_text(CALCULATES)
    axis = slide("left", "left_x", more='program = "counts.prg"\nstart = true')
    (tmp_path / "world.toml").write_text(axis)
    run, watched = (World.load(tmp_path / "world.toml") for _ in range(2))
    run.run(until=condition)
    assert 0 < run.now < 1_500_000_000
    watch = read_property(f"eventually {condition}").watch(watched)
    watched.run(until=2.0)
    assert watch.verdict().at_ns == run.now


@pytest.mark.parametrize(("text", "most"), [("always left_x.position < 1000", 7), ("always left.M1.moving == 0", 4)])
def test_each_motion_is_read_a_few_times_only(text: str, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """At its beginning, where it turns, at its end and once before the next one."""
    moves = 40
    reads: list[str] = []
    for kind, name in ((Trajectory, "load_at"), (Profile, "moving")):
        counted = getattr(kind, name)
        monkeypatch.setattr(kind, name, lambda self, now, counted=counted: reads.append("") or counted(self, now))
    counts: list[int] = []
    for properties in ((), (text,)):
        world = World.from_toml(slide("left", "left_x", ramps=2000.0, vel=200.0))
        watches = [read_property(one).watch(world) for one in properties]
        world.mic488["left"].axis[1].enable()
        reads.clear()
        for n in range(moves):
            world.mic488["left"].axis[1].move_to(5.0 * (n % 2 + 1))
            world.run(for_=0.5)
        assert all(one.verdict() is not None for one in watches)
        counts.append(len(reads))
    assert 0 < counts[1] - counts[0] <= most * moves + 10
