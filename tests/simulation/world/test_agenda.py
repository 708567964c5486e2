"""When waiting scripts are looked at, against the plainest bookkeeping."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from tests.support.toy.controller import Bare

from steptwin.errors import Misuse
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.world.agenda import Agenda, Dependencies


@dataclass(eq=False)
class Waiter:
    """What an agenda needs of a script."""

    number: int
    entry: int = 0
    sources: tuple[Any, ...] = field(default=())


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


@settings(max_examples=20)
@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 1000)), min_size=300, max_size=400))
def test_outdated_entries_are_cleared_away(moments: list[tuple[int, int]]) -> None:
    agenda: Any = Agenda()
    scripts = [Waiter(number) for number in range(4)]
    last = {}
    for n, due in moments:
        agenda.wait(scripts[n], due)
        last[n] = due
        assert len(agenda._timed.entries) <= 2 * 4 + 2 * 64, "outdated entries pile up"
    order = sorted(last, key=lambda n: (last[n], n))
    assert [agenda.take_timed(1000).number for _ in order] == order
    assert agenda.take_timed(1000) is None


def joined(*names: str) -> Scheduler:
    """A scheduler with a machine of each name."""
    scheduler = Scheduler()
    for name in names:
        scheduler.add(name, Bare())
    scheduler.propagate()
    return scheduler


def test_scripts_are_evaluated_when_what_they_depend_on_has_changed() -> None:
    dependencies: Any = Dependencies()
    one, other, third = joined("a", "b"), joined("c"), joined("d")
    a, b, c = one.source("a"), one.source("b"), other.source("c")
    scripts = [Waiter(number) for number in range(3)]
    assert dependencies.take() == []
    dependencies.set(scripts[2], (a, c))
    dependencies.set(scripts[0], (b, c))
    dependencies.set(scripts[1], ())
    one.notify()
    assert dependencies.take() == [scripts[0], scripts[2]]
    assert dependencies.take() == []
    one.notify("a")
    assert dependencies.take() == [scripts[2]]
    assert dependencies.take() == []
    other.notify("c")
    one.notify("b")
    third.notify("d")
    assert dependencies.take() == [scripts[0], scripts[2]], "each once, in the order of their numbers"
    dependencies.again(scripts[1])
    other.notify()
    assert dependencies.take() == scripts
    assert dependencies.take() == []
    dependencies.set(scripts[2], (a,))
    other.notify("c")
    one.notify("b")
    assert dependencies.take() == [scripts[0]]
    dependencies.set(scripts[0], ())
    assert (other.on_change, scripts[0].sources) == (None, ())
    other.notify("c")
    one.notify("b")
    assert dependencies.take() == []
    assert one.on_change is not None
    dependencies.set(scripts[1], (a,))
    dependencies.set(scripts[2], ())
    one.notify("a")
    assert dependencies.take() == [scripts[1]]
    dependencies.set(scripts[1], ())
    assert one.on_change is None


def test_only_what_computes_signals_is_a_source() -> None:
    with pytest.raises(Misuse, match="nothing computes signals of 'x': there are a, b"):
        joined("a", "b").source("x")


def test_who_watches_now_waits_for_no_moment_any_more() -> None:
    agenda: Any = Agenda()
    script = Waiter(1)
    agenda.wait(script, 10)
    agenda.watch(script, None)
    assert agenda.first() is None
    agenda.watch(script, 20)
    assert (agenda.first(), agenda.take_timed(30), agenda.take_watching(20)) == (20, None, [script])
    assert agenda.first() is None
    agenda.wait(script, 40)
    agenda.remove(script)
    assert (agenda.first(), agenda.take_timed(50)) == (None, None)


def test_outdated_entries_do_not_pile_up() -> None:
    agenda: Any = Agenda()
    script, other = Waiter(1), Waiter(2)
    agenda.wait(other, 5)
    for due in range(1000):
        agenda.wait(script, due)
        assert len(agenda._timed.entries) < 100
    assert (agenda.take_timed(999), agenda.take_timed(999), agenda.take_timed(999)) == (other, script, None)


def test_outdated_entries_are_removed_when_they_are_as_many_as_the_others() -> None:
    agenda: Any = Agenda()
    scripts, lengths = [Waiter(number) for number in range(65)], []
    for script in scripts:
        agenda.wait(script, 1)
    for moment in range(2, 132):
        agenda.wait(scripts[0], moment)
        lengths.append(len(agenda._timed.entries))
    assert lengths == [*range(66, 195), 65]
