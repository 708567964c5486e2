"""Parts of a scheduler: nothing that is kept by their numbers gets lost when they are numbered anew."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import pytest

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.files.world import World
from steptwin.simulation.scheduler.scheduledparts import ScheduledParts
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.state import Plain

MACHINE = '[[mic488]]\nname = "b"\n[[axis]]\nname = "x"\ndrive = "b.M1"\n'
TABLES = (
    '[[transducer]]\nname = "v"\nof = "x.position"\nto = "b.AIN1"\npoints = [[0, 0], [100, 10]]\n',
    (
        '[[conveyor]]\nname = "belt"\nlength = 500\nspeed = 100\nfeed_every = "700 ms"\n'
        '[[conveyor.sensor]]\nat = 90\nto = "b.IN3"\n'
    ),
    '[[relay]]\nname = "r"\ncoil = "b.OUT2"\n',
)


class Clock:
    """A part with an event of its own every ``period``."""

    def __init__(self, period: Nanos) -> None:
        self.period = period
        self.due = period
        self.events: list[Nanos] = []

    def deadline(self) -> Nanos | None:
        return self.due

    def update(self, now: Nanos) -> None:
        while self.due <= now:
            self.events.append(now)
            self.due += self.period

    def copy_state(self) -> Plain:
        return (self.due,)

    def set_state(self, plain: Any) -> None:
        (self.due,) = plain


def test_parts_keep_what_they_watch_when_they_are_numbered_anew() -> None:
    """Part 0 watches b, part 1 computes b from a, part 2 watches everything."""
    parts, clocks = ScheduledParts(), [Clock(1), Clock(2), Clock(3)]
    numbers = [
        parts.add(clocks[0], ["b"], None, None),
        parts.add(clocks[1], ["a", "a"], "b", None),
        parts.add(clocks[2], None, None, "a"),
    ]
    assert numbers == [0, 1, 2]
    order = parts.order([])
    assert order == [2, 1, 0]
    found = parts.arranged(order)
    assert found.parts == clocks[::-1]
    assert (found.by_name, found.all, found.computes) == ({"b": [2], "a": [1]}, [0], [None, "b", None])
    assert found.order([]) == ()


def test_what_a_part_depends_on_may_be_known_later_and_leaves_the_order_as_it_is() -> None:
    parts, holders = ScheduledParts(), ["a"]
    parts.add(Clock(1), lambda: holders, None, None)
    parts.add(Clock(2), ["b"], None, None)
    parts.add(Clock(3), (), "c", None)
    parts.add(Clock(4), ["b"], None, None, reads=["c"])
    found = parts.arranged(parts.order([]))
    holders.append("b")
    assert (found.all, found.by_name, found.readers) == ([2, 3], {"b": [0]}, {})
    found.resolve()
    assert (found.all, found.by_name, found.readers) == ([], {"a": [2], "b": [0, 2, 3], "c": [3]}, {1: [3]})


@pytest.mark.parametrize("is_settled", [False, True])
def test_each_part_has_its_own_deadlines_when_they_are_numbered_anew(is_settled: bool) -> None:
    scheduler, clocks = Scheduler(), [Clock(period * MILLISECOND) for period in (2, 3, 5)]
    for clock in clocks:
        scheduler.add_part(clock, ())
    if is_settled:
        assert scheduler.deadline() == 2 * MILLISECOND
    scheduler.arrange([2, 0, 1])
    scheduler.advance(10 * MILLISECOND)
    assert [clock.events for clock in clocks] == [[*range(one.period, 10 * MILLISECOND + 1, one.period)] for one in clocks]


@pytest.mark.parametrize("tables", [*permutations(TABLES)], ids=lambda tables: "-".join(text[2:6] for text in tables))
def test_an_element_acts_at_its_moments_beside_others_in_any_order(tables: tuple[str, ...]) -> None:
    world = World.from_toml(MACHINE + "".join(tables))
    snapshot = world.snapshot()
    world.run(until=3)
    assert world.read("belt.fed") == 1
    digest = world.trace.digest()
    world.restore(snapshot)
    world.run(until=3)
    assert (world.read("belt.fed"), world.trace.digest()) == (1, digest)
    assert world.now == 3 * SECOND
