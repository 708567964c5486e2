"""States that are kept while a world runs save the first run of its past, and change no answer."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import pytest

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.why.replayedrun import ReplayedRun

EXAMPLES = Path(__file__).parents[2] / "examples/worlds"
QUESTIONS = ("cell", "cell.OUT1", "cell.IN3", "cell.OUT8 == 1", "not cell.OUT1")


@pytest.mark.parametrize(("name", "end"), [("pick_and_place", 25.0), ("labeller", 12.3), ("press", 2.2)])
def test_answers_are_the_same(name: str, end: float) -> None:
    path = EXAMPLES / name / f"{name}.toml"
    kept, run_again = World.load(path), World.load(path)
    kept.keep_states()
    for world in (kept, run_again):
        world.run(end / 2)
        world.run("time > 1000", for_=end / 2)
    assert kept.trace.digest() == run_again.trace.digest()
    with patch.object(ReplayedRun, "_run", side_effect=AssertionError("run again")):
        answers = [kept.past.ask(question, at) for question in QUESTIONS for at in (None, round(end * 7e8))]
    assert answers == [run_again.past.ask(question, at) for question in QUESTIONS for at in (None, round(end * 7e8))]


def test_they_are_given_up_where_a_snapshot_is_restored() -> None:
    world = World.load(EXAMPLES / "press/press.toml")
    world.keep_states()
    taken = world.snapshot()
    world.run(2.0)
    world.restore(taken)
    world.run(2.1)
    again = World.load(EXAMPLES / "press/press.toml")
    again.run(2.1)
    assert world.why("cell.OUT1") == again.why("cell.OUT1")


def test_they_are_kept_from_the_beginning_on() -> None:
    world = World.load(EXAMPLES / "press/press.toml")
    world.run(0.1)
    with pytest.raises(Misuse, match="from their beginning on"):
        world.keep_states()
