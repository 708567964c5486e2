"""Who follows the signals of a kernel: told of what concerns it, once for each event, and before it if it wants that."""

from __future__ import annotations

import pytest
from toy import Bare

from steptwin.machine import Nanos, PinEdge
from steptwin.simulation.scheduler.kernel import Kernel
from steptwin.simulation.scheduler.wires import PinName, Wire


class Clock(Bare):
    """Switches B at each of its moments."""

    __slots__ = ("dues", "levels")

    def __init__(self, *dues: Nanos) -> None:
        super().__init__()
        self.dues = list(dues)
        self.levels = {"A": 0.0, "B": 0.0}

    def advance(self, now: Nanos) -> None:
        super().advance(now)
        while self.dues and self.dues[0] <= now:
            self.levels["B"] = 1.0 - self.levels["B"]
            self.edges.append(PinEdge(self.dues.pop(0), "B", self.levels["B"]))
            self.changed()

    def deadline(self) -> Nanos | None:
        return self.dues[0] if self.dues else None

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


@pytest.mark.parametrize("attentive", [False, True])
def test_of_a_machine_alone(attentive: bool) -> None:
    kernel, plain, leaving, other = Kernel(), Told(), Told(), Told()
    kernel.add("m", Clock(10, 20, 20, 30))
    kernel.is_attentive = attentive
    kernel.settle()
    kernel.follow(plain, ["m"])
    kernel.follow(leaving, ["m", "x"], leaves=True)
    kernel.follow(other, ["x"])
    kernel.advance(25)
    assert (plain.take(), other.take()) == (([10, 20], []), ([], []))
    assert leaving.take() == ([10, 20], [10, 20, 25])
    kernel.advance(25)
    assert leaving.take() == ([], [])
    kernel.machines["m"].set_pin("A", 1.0, 25)
    kernel.settle()
    assert (plain.take(), leaving.take()) == (([25], []), ([25], []))
    kernel.unfollow(plain)
    kernel.unfollow(other)
    kernel.advance(40)
    assert (plain.take(), leaving.take()) == (([], []), ([30], [30, 40]))
    kernel.unfollow(leaving)
    kernel.advance(50)
    assert leaving.take() == ([], [])


def test_of_machines_that_are_joined() -> None:
    kernel, one, two, both = Kernel(), Told(), Told(), Told()
    kernel.add("a", Clock(10, 30))
    kernel.add("b", Clock(20))
    kernel.add("c", Clock(60, 70))
    kernel.connect(Wire(PinName("a", "B"), PinName("b", "A")))
    kernel.settle()
    kernel.follow(one, ["a"])
    kernel.follow(two, ["b"], leaves=True)
    kernel.follow(both, ["a", "b"])
    kernel.advance(50)
    assert one.take() == ([10, 30], [])
    assert two.take() == ([10, 20, 30], [10, 20, 30, 50])  # the wire changes its input
    assert both.take() == ([10, 20, 30], [])
    kernel.unfollow(two)
    kernel.machines["b"].set_pin("A", 0.0, 50)
    kernel.settle()
    assert (one.take(), two.take(), both.take()) == (([], []), ([], []), ([50], []))
    kernel.advance(80)
    assert both.take() == ([], [])


def test_who_is_gone_is_not_told_what_is_new_already() -> None:
    kernel, one, other = Kernel(), Told(), Told()
    kernel.add("m", Clock())
    kernel.settle()
    kernel.follow(one, ["m"])
    kernel.follow(other, ["m"])
    assert kernel.followers is not None
    kernel.followers.news = {one: None, other: None}
    kernel.unfollow(one)
    kernel.followers.tell(5)
    assert (one.take(), other.take()) == (([], []), ([5], []))
    assert kernel.followers.news == {}


@pytest.mark.parametrize("attentive", [False, True])
def test_two_that_are_due_together_do_not_run_ahead_of_each_other(attentive: bool) -> None:
    """What one switches reaches the other before that goes on."""
    seen: list[tuple[Nanos, float]] = []

    class Ahead(Clock):
        def advance_to_change(self, until: Nanos) -> Nanos:
            self.advance(until)
            return until

        def set_pin(self, pin: str, value: float, now: Nanos) -> None:
            super().set_pin(pin, value, now)
            seen.append((now, value))

    kernel = Kernel()
    kernel.add("a", Clock(10, 20))
    kernel.add("b", Ahead(10))
    kernel.is_attentive = attentive
    kernel.connect(Wire(PinName("a", "B"), PinName("b", "A")))
    kernel.settle()
    kernel.advance(30)
    assert seen == [(0, 0.0), (10, 1.0), (20, 0.0)]


def test_who_wants_to_be_told_before_each_event_is_told_once_of_a_moment() -> None:
    kernel, leaving = Kernel(), Told()
    kernel.add("m", Clock())
    kernel.follow(leaving, ["m"], leaves=True)
    kernel.advance(5)
    assert leaving.take() == ([0], [5])
    kernel.advance(5)
    assert leaving.take() == ([], [])
