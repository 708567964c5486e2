"""Who follows the signals of a scheduler: told of what concerns it, once for each event, and before it if it wants that."""

from __future__ import annotations

import pytest
from toy import Bare

from steptwin.controller import Nanos, PinEdge
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName, Wire


class Clock(Bare):
    """Switches B at each of its moments."""

    __slots__ = ("deadlines", "levels")

    def __init__(self, *deadlines: Nanos) -> None:
        super().__init__()
        self.deadlines = list(deadlines)
        self.levels = {"A": 0.0, "B": 0.0}

    def advance(self, now: Nanos) -> None:
        super().advance(now)
        while self.deadlines and self.deadlines[0] <= now:
            self.levels["B"] = 1.0 - self.levels["B"]
            self.edges.append(PinEdge(self.deadlines.pop(0), "B", self.levels["B"]))
            self.changed()

    def deadline(self) -> Nanos | None:
        return self.deadlines[0] if self.deadlines else None

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        self.advance(now)
        self.levels[pin] = value
        self.changed()

    def pins(self) -> dict[str, float]:
        return dict(self.levels)

    def pin(self, name: str) -> float:
        return self.levels[name]


class Told:
    """A follower."""

    def __init__(self) -> None:
        self.looks: list[Nanos] = []
        self.leaves: list[Nanos] = []

    def leave(self, moment: Nanos) -> None:
        self.leaves.append(moment)

    def look(self, now: Nanos) -> None:
        self.looks.append(now)

    def take(self) -> tuple[list[Nanos], list[Nanos]]:
        found = self.looks, self.leaves
        self.looks, self.leaves = [], []
        return found


@pytest.mark.parametrize("step_exact", [False, True])
def test_of_a_controller_alone(step_exact: bool) -> None:
    scheduler, plain, leaving, other = Scheduler(), Told(), Told(), Told()
    scheduler.add("m", Clock(10, 20, 20, 30))
    scheduler.is_step_exact = step_exact
    scheduler.propagate()
    scheduler.subscribe(plain, ["m"])
    scheduler.subscribe(leaving, ["m", "x"], leaves=True)
    scheduler.subscribe(other, ["x"])
    scheduler.advance(25)
    assert (plain.take(), other.take()) == (([10, 20], []), ([], []))
    assert leaving.take() == ([10, 20], [10, 20, 25])
    scheduler.advance(25)
    assert leaving.take() == ([], [])
    scheduler.controllers["m"].set_pin("A", 1.0, 25)
    scheduler.propagate()
    assert (plain.take(), leaving.take()) == (([25], []), ([25], []))
    scheduler.unsubscribe(plain)
    scheduler.unsubscribe(other)
    scheduler.advance(40)
    assert (plain.take(), leaving.take()) == (([], []), ([30], [30, 40]))
    scheduler.unsubscribe(leaving)
    scheduler.advance(50)
    assert leaving.take() == ([], [])


def test_of_controllers_that_are_joined() -> None:
    scheduler, one, two, both = Scheduler(), Told(), Told(), Told()
    scheduler.add("a", Clock(10, 30))
    scheduler.add("b", Clock(20))
    scheduler.add("c", Clock(60, 70))
    scheduler.connect(Wire(PinName("a", "B"), PinName("b", "A")))
    scheduler.propagate()
    scheduler.subscribe(one, ["a"])
    scheduler.subscribe(two, ["b"], leaves=True)
    scheduler.subscribe(both, ["a", "b"])
    scheduler.advance(50)
    assert one.take() == ([10, 30], [])
    assert two.take() == ([10, 20, 30], [10, 20, 30, 50])  # the wire changes its input
    assert both.take() == ([10, 20, 30], [])
    scheduler.unsubscribe(two)
    scheduler.controllers["b"].set_pin("A", 0.0, 50)
    scheduler.propagate()
    assert (one.take(), two.take(), both.take()) == (([], []), ([], []), ([50], []))
    scheduler.advance(80)
    assert both.take() == ([], [])


def test_who_is_gone_is_not_told_what_is_new_already() -> None:
    scheduler, one, other = Scheduler(), Told(), Told()
    scheduler.add("m", Clock())
    scheduler.propagate()
    scheduler.subscribe(one, ["m"])
    scheduler.subscribe(other, ["m"])
    assert scheduler.subscribers is not None
    scheduler.subscribers.news = {one: None, other: None}
    scheduler.unsubscribe(one)
    scheduler.subscribers.notify(5)
    assert (one.take(), other.take()) == (([], []), ([5], []))
    assert scheduler.subscribers.news == {}


@pytest.mark.parametrize("step_exact", [False, True])
def test_two_that_are_due_together_do_not_run_ahead_of_each_other(step_exact: bool) -> None:
    """What one switches reaches the other before that goes on."""
    seen: list[tuple[Nanos, float]] = []

    class Ahead(Clock):
        def advance_to_change(self, until: Nanos) -> Nanos:
            self.advance(until)
            return until

        def set_pin(self, pin: str, value: float, now: Nanos) -> None:
            super().set_pin(pin, value, now)
            seen.append((now, value))

    scheduler = Scheduler()
    scheduler.add("a", Clock(10, 20))
    scheduler.add("b", Ahead(10))
    scheduler.is_step_exact = step_exact
    scheduler.connect(Wire(PinName("a", "B"), PinName("b", "A")))
    scheduler.propagate()
    scheduler.advance(30)
    assert seen == [(0, 0.0), (10, 1.0), (20, 0.0)]


def test_who_wants_to_be_told_before_each_event_is_told_once_of_a_moment() -> None:
    scheduler, leaving = Scheduler(), Told()
    scheduler.add("m", Clock())
    scheduler.subscribe(leaving, ["m"], leaves=True)
    scheduler.advance(5)
    assert leaving.take() == ([0], [5])
    scheduler.advance(5)
    assert leaving.take() == ([], [])
