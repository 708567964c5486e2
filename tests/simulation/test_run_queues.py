"""An event costs what it changes: nothing else is looked at, and nothing that has changed is missed."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.controller import SECOND, Nanos
from steptwin.files.world import World
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.state import Plain

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
FOLLOWING = """
[[mic488]]
name = "one"
[mic488.M1]
acc = 1000.0
dec = 1000.0
vel = 400.0
[[mic488]]
name = "two"
[[axis]]
name = "x"
drive = "one.M1"
backlash = 2.0
[[axis.switch]]
above = 100.0
to = "two.IN3"
bounce = "2 ms"
[[axis]]
name = "y"
drive = "two.M1"
[axis.encoder]
follows = "x"
[[conveyor]]
name = "belt"
length = 300.0
axis = "x"
feed_every = "300 ms"
[[conveyor.sensor]]
at = 80.0
to = "two.IN4"
[[vacuum]]
name = "cup"
ejector = "one.OUT1"
pick = "one.OUT1"
from = "belt"
pick_at = 90.0
[[button]]
name = "start"
to = "one.IN1"
bounce = "3 ms"
[[wire]]
from = "cup.held"
to = "two.IN5"
delay = "5 ms"
[[event]]
every = "700 ms"
steps = [
  { press = "start", for = "20 ms" },
  { write = { "one.M1_EN" = 1, "one.M1_POS_ABS" = 400, "one.OUT1" = 1 } },
  { wait = "500 ms" },
  { write = { "one.M1_POS_ABS" = 0, "one.OUT1" = 0 } },
]
"""


def missed(scheduler: Scheduler) -> list[object]:
    """What an update of every part and a look at every machine still finds."""
    scheduler.deadline()
    found: list[object] = []
    for part in scheduler.parts:
        before = repr(part.copy_state())
        part.update(scheduler.now)
        if scheduler.is_dirty or repr(part.copy_state()) != before:
            found.append(part)
    deadlines = [one.deadline() for one in (*scheduler.controllers.values(), *scheduler.parts)]
    if scheduler.deadline() != min((due for due in deadlines if due is not None), default=None):
        found.append(deadlines)
    return [*found, *(edge for controller in scheduler.controllers.values() for edge in controller.take_edges())]


@pytest.mark.parametrize(
    "name", ["pick_and_place/pick_and_place.toml", "feeder.toml", "handwheel.toml", "lift.toml", "press/press.toml", ""]
)
def test_nothing_that_has_changed_is_missed(name: str) -> None:
    world = World.load(EXAMPLES / name) if name else World.from_toml(FOLLOWING)
    with world:
        for _ in range(300):
            if world.stopped is not None:
                break
            world.run(for_=0.0137)
            schedulers = [scheduler for scheduler in world.schedulers if not scheduler.wires.delayed]
            assert [missed(scheduler) for scheduler in schedulers] == [[]] * len(schedulers), world.now


class Clock:
    """A part with an event of its own every ``period``."""

    def __init__(self, period: Nanos) -> None:
        self.period = self.due = period
        self.updates = 0

    def update(self, now: Nanos) -> None:
        self.updates += 1
        while self.due <= now:
            self.due += self.period

    def deadline(self) -> Nanos | None:
        return self.due

    def copy_state(self) -> Plain:
        return (self.due,)

    def set_state(self, plain: Plain) -> None:
        (self.due,) = plain


def test_a_part_is_updated_for_what_it_watches_and_when_it_is_due() -> None:
    """One that watches everything is updated with every event."""
    scheduler = Scheduler()
    usual, other, curious = Clock(SECOND), Clock(10 * SECOND), Clock(100 * SECOND)
    scheduler.add_part(usual, ("a", "b"))
    scheduler.add_part(other, ())
    scheduler.add_part(curious)
    scheduler.advance(0)

    assert (usual.updates, other.updates, curious.updates) == (1, 1, 1)
    for changed in ("a", "b", "c"):
        scheduler.notify(changed)
        scheduler.advance(0)
    assert (usual.updates, other.updates, curious.updates) == (3, 1, 4)
    scheduler.advance(20 * SECOND)
    assert (usual.updates, other.updates, curious.updates) == (23, 3, 24)
    scheduler.notify()
    scheduler.advance(20 * SECOND)
    assert (usual.updates, other.updates, curious.updates) == (24, 4, 25)


def test_a_part_that_reads_signals_is_updated_after_each_update_of_what_computes_them() -> None:
    """Also where it comes first, and what computes them reports no change."""
    scheduler = Scheduler()
    first, clock, last = Clock(100 * SECOND), Clock(SECOND), Clock(100 * SECOND)
    scheduler.add_part(first, (), reads=("a",))
    scheduler.add_part(clock, (), "a")
    scheduler.add_part(last, (), reads=("a", "b"))
    scheduler.arrange(())
    scheduler.advance(0)
    assert (first.updates, clock.updates, last.updates) == (2, 1, 1)
    scheduler.advance(3 * SECOND)
    assert (first.updates, clock.updates, last.updates) == (5, 4, 4)
    scheduler.notify("b")
    scheduler.advance(3 * SECOND)
    assert (first.updates, clock.updates, last.updates) == (5, 4, 5)


def test_a_part_that_comes_later_is_told_as_a_change() -> None:
    told: list[Scheduler] = []
    scheduler = Scheduler()
    scheduler.on_change = told.append
    scheduler.add_part(Clock(SECOND))
    assert told == [scheduler]
