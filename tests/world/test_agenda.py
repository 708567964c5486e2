"""When waiting scripts are looked at, against the plainest bookkeeping."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from steptwin.world.agenda import Agenda, Watchers
from steptwin.world.kernel import Kernel


@dataclass(eq=False)
class Waiter:
    """What an agenda needs of a script."""

    number: int
    entry: int = 0
    kernels: tuple[Any, ...] = field(default=())


class Book(RuleBasedStateMachine):
    """Scripts wait for moments, watch, or do neither; each has one due moment in an agenda at most."""

    def __init__(self) -> None:
        super().__init__()
        self.agenda: Any = Agenda()
        self.scripts = [Waiter(number) for number in range(6)]
        self.timed: dict[int, int] = {}
        self.watching: dict[int, int] = {}

    @rule(n=st.integers(0, 5), due=st.integers(0, 9))
    def wait(self, n: int, due: int) -> None:
        self.agenda.wait(self.scripts[n], due)
        self.watching.pop(n, None)
        self.timed[n] = due

    @rule(n=st.integers(0, 5), due=st.one_of(st.none(), st.integers(0, 9)))
    def watch(self, n: int, due: int | None) -> None:
        self.agenda.watch(self.scripts[n], due)
        self.timed.pop(n, None)
        self.watching.pop(n, None)
        if due is not None:
            self.watching[n] = due

    @rule(n=st.integers(0, 5))
    def remove(self, n: int) -> None:
        self.agenda.remove(self.scripts[n])
        self.timed.pop(n, None)
        self.watching.pop(n, None)

    @rule(now=st.integers(0, 9))
    def take_timed(self, now: int) -> None:
        taken = self.agenda.take_timed(now)
        expected = min(((due, n) for n, due in self.timed.items() if due <= now), default=None)
        assert (None if taken is None else taken.number) == (None if expected is None else expected[1])
        if expected is not None:
            del self.timed[expected[1]]

    @rule(now=st.integers(0, 9))
    def take_watching(self, now: int) -> None:
        expected = sorted((due, n) for n, due in self.watching.items() if due <= now)
        assert [script.number for script in self.agenda.take_watching(now)] == [n for _, n in expected]
        for _, n in expected:
            del self.watching[n]

    @invariant()
    def the_first_moment_is_that_of_the_book(self) -> None:
        assert self.agenda.first() == min([*self.timed.values(), *self.watching.values()], default=None)


TestBook = Book.TestCase


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 1000)), min_size=300, max_size=400))
def test_outdated_entries_are_cleared_away(moments: list[tuple[int, int]]) -> None:
    agenda: Any = Agenda()
    scripts = [Waiter(number) for number in range(4)]
    last = {}
    for n, due in moments:
        agenda.wait(scripts[n], due)
        last[n] = due
        assert len(agenda._timed._entries) <= 2 * 4 + 2 * 64, "outdated entries pile up"
    order = sorted(last, key=lambda n: (last[n], n))
    assert [agenda.take_timed(1000).number for _ in order] == order
    assert agenda.take_timed(1000) is None


def test_watchers_are_those_of_kernels_that_have_changed() -> None:
    watchers: Any = Watchers()
    kernels = [Kernel() for _ in range(3)]
    scripts = [Waiter(number) for number in range(3)]
    assert watchers.take() == []
    watchers.set(scripts[2], (kernels[0], kernels[1]))
    watchers.set(scripts[0], (kernels[1],))
    watchers.set(scripts[1], ())
    assert watchers.take() == []
    kernels[0].mark()
    assert watchers.take() == [scripts[2]]
    assert watchers.take() == []
    kernels[1].mark()
    kernels[0].mark()
    kernels[2].mark()
    assert watchers.take() == [scripts[0], scripts[2]], "each once, in the order of their numbers"
    watchers.again(scripts[1])
    kernels[1].mark()
    assert watchers.take() == scripts
    assert watchers.take() == []
    watchers.set(scripts[2], (kernels[0],))
    kernels[1].mark()
    assert watchers.take() == [scripts[0]]
    watchers.set(scripts[0], ())
    assert (kernels[1].on_change, scripts[0].kernels) == (None, ())
    kernels[1].mark()
    assert watchers.take() == []
    assert kernels[0].on_change is not None
    watchers.set(scripts[1], (kernels[0],))
    watchers.set(scripts[2], ())
    kernels[0].mark()
    assert watchers.take() == [scripts[1]]
