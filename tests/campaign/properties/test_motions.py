"""Properties of real motions beside dense samples of the same signals; and moments before a watch began."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from slides import slide

from steptwin.campaign.properties import read_property
from steptwin.files.world import World

WORLD = slide(travel=(-50.0, 50.0))
TRAVEL = 100.0  # mm
SPEED = 50.0  # mm/s
STEP = 0.005  # s
NEAR = SPEED * STEP / TRAVEL + 0.00125 / TRAVEL + 0.001  # between two samples, a pulse, and the deviation of straight intervals


@settings(max_examples=30, deadline=None)
@given(
    moves=st.lists(st.tuples(st.floats(-20.0, 20.0), st.floats(0.02, 0.5)), min_size=1, max_size=3),
    limits=st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
)
def test_robustness_is_that_of_dense_samples(moves: list[tuple[float, float]], limits: tuple[float, float]) -> None:
    """One comparison, and two that meet: whichever is less at each moment."""
    world = World.from_toml(WORLD)
    world.mic488["table"].axis[1].enable()
    high, low = limits
    watches = [
        read_property(text).watch(world)
        for text in (
            f"always x.position < {high:.3f}",
            f"eventually x.position > {high:.3f}",
            f"always (x.position < {high:.3f} or x.position > {low:.3f})",
        )
    ]
    samples = [world.read("x.position")]
    for to, seconds in moves:
        world.mic488["table"].axis[1].move_to(to)
        for _ in range(int(seconds / STEP)):
            world.run(for_=STEP)
            samples.append(world.read("x.position"))
    below = [(round(high, 3) - place) / TRAVEL for place in samples]
    above = [(place - round(low, 3)) / TRAVEL for place in samples]
    expected = (min(below), max(-one for one in below), min(map(max, below, above)))
    for watch, value in zip(watches, expected, strict=True):
        verdict = watch.verdict()
        assert abs(verdict.robustness - value) <= NEAR
        if abs(value) > NEAR:
            assert verdict.holds is (value > 0.0)


def test_a_moment_before_the_watch_began_begins_it_there() -> None:
    world = World.from_toml(WORLD)
    world.mic488["table"].axis[1].enable()
    before = world.snapshot()
    world.mic488["table"].axis[1].move_to(40.0)
    world.run(for_="2 s")
    watch = read_property("always x.position < 30").watch(world)
    assert not watch.verdict().holds
    world.restore(before)
    world.run(for_="2 s")
    assert world.read("x.position") == 0.0
    assert watch.verdict().holds
    assert watch.verdict().robustness == 0.3  # 30 of 100 mm
