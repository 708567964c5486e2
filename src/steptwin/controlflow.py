"""The control flow of a program: one graph for checkers, coverage and explanations, whatever the language.

Statements are numbered from 0; the number after the last one is the end. A call remembers the statement after it. That is reached
only if what was called can return: an end is reached that takes back the call which led there, every call on the way having been
taken back itself. Questions are answered in time linear in the size of the graph; `ControlFlow.next` states its exception.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class ControlFlow:
    """``after``: where each statement goes on within its level, a branch at several; a call at the statement after it.

    ``calls``: what each call calls. ``ends``: the statements that return; where one goes on if there is nothing to return to.
    ``interrupts``: where interrupts begin, whose ends lead back to whatever was interrupted.
    """

    after: Sequence[tuple[int, ...]]
    calls: Mapping[int, tuple[int, ...]]
    ends: frozenset[int]
    interrupts: tuple[int, ...] = ()

    @cached_property
    def returns(self) -> list[bool]:
        """Whether each statement, and last the end of the program, can reach an end of the call that led to it."""
        count = len(self.after)
        before: list[list[int]] = [[] for _ in range(count + 1)]
        callers: list[list[int]] = [[] for _ in range(count + 1)]
        called_before: list[list[int]] = [[] for _ in range(count + 1)]
        for number, following in enumerate(self.after):
            targets = self.calls.get(number)
            for target in targets or ():
                callers[target].append(number)
            for after in following:
                (before if targets is None else called_before)[after].append(number)
        can = [False] * (count + 1)
        work = list(self.ends)
        while work:
            number = work.pop()
            if can[number]:
                continue
            can[number] = True
            work += before[number]
            work += [caller for caller in callers[number] if any(can[after] for after in self.after[caller])]
            work += [caller for caller in called_before[number] if self.comes_back(caller, can)]
        return can

    def comes_back(self, number: int, can: Sequence[bool] | None = None) -> bool:
        """Whether what a statement calls can return; True for a statement that calls nothing."""
        targets = self.calls.get(number)
        can = self.returns if can is None else can
        return targets is None or any(can[target] for target in targets)

    def within(self, number: int) -> tuple[int, ...]:
        """Where a statement goes on within its level: nowhere after a call that does not return."""
        return self.after[number] if number < len(self.after) and self.comes_back(number) else ()

    def level(self, start: int, barriers: frozenset[int] = frozenset()) -> Iterator[int]:
        """The statements reached from one without following calls, the end included, but not beyond other ``barriers``."""
        seen: set[int] = set()
        work = [start]
        while work:
            number = work.pop()
            if number in seen:
                continue
            seen.add(number)
            yield number
            if number == start or number not in barriers:
                work += self.within(number)

    def reached(self, starts: Iterable[int]) -> set[int]:
        """The statements that can be executed after those at ``starts``, these and the end included."""
        seen: set[int] = set()
        work = list(starts)
        while work:
            number = work.pop()
            if number not in seen:
                seen.add(number)
                work += self.calls.get(number, ())
                work += self.within(number)
        return seen

    def later(self, starts: Iterable[int]) -> set[int]:
        """As `reached`, also behind the calls that can have led to those at ``starts``."""
        return {number for component in self.components(starts) for number in component}

    @cached_property
    def next(self) -> list[tuple[int, ...]]:
        """Statements that can be executed right after each statement.

        Behind a call stands what it calls; behind the end of a call what follows the calls that can lead there. Takes a pass over
        the graph for each target of a call.
        """
        back: dict[int, set[int]] = {number: set() for number in self.ends}
        sites: dict[int, set[int]] = {}
        for number, targets in self.calls.items():
            for target in targets:
                sites.setdefault(target, set()).update(self.after[number])
        for target, following in sites.items():
            for number in self.level(target):
                if number in back:
                    back[number] |= following
        return [
            tuple(sorted({*back[number], *following})) if number in back else self.calls.get(number, following)
            for number, following in enumerate(self.after)
        ]

    def without_way_out(self, starts: Iterable[int]) -> list[list[int]]:
        """The loops, each with its statements in order, that are reached from ``starts`` and that no way leads out of."""
        return [sorted(one) for one in self.components(starts) if self._is_closed(one)]

    def components(self, starts: Iterable[int]) -> Iterator[set[int]]:
        """The statements reached from ``starts``, those together that can be reached from each other."""
        return _components(self.next, starts)

    @cached_property
    def _interrupt_ends(self) -> frozenset[int]:
        return frozenset(number for start in self.interrupts for number in self.level(start) if number in self.ends)

    def _is_closed(self, component: set[int]) -> bool:
        if not component.isdisjoint(self._interrupt_ends):
            return False  # it may be executed as an interrupt of what is outside
        ways = [after for number in component if number < len(self.next) for after in self.next[number]]
        return bool(ways) and component.issuperset(ways)


def _components(after: Sequence[tuple[int, ...]], starts: Iterable[int]) -> Iterator[set[int]]:
    """The strongly connected components of what is reached from ``starts``: Tarjan's algorithm, without recursion."""
    order: dict[int, int] = {}
    lowest: dict[int, int] = {}
    stack: list[int] = []
    open_: set[int] = set()
    for start in starts:
        if start in order:
            continue
        work: list[tuple[int, Iterator[int]]] = []
        _open(start, order, lowest, stack, open_)
        work.append((start, _after(after, start)))
        while work:
            number, ways = work[-1]
            for target in ways:
                if target not in order:
                    _open(target, order, lowest, stack, open_)
                    work.append((target, _after(after, target)))
                    break
                if target in open_:
                    lowest[number] = min(lowest[number], order[target])
            else:
                work.pop()
                if work:
                    lowest[work[-1][0]] = min(lowest[work[-1][0]], lowest[number])
                if lowest[number] == order[number]:
                    at = stack.index(number)
                    component = set(stack[at:])
                    del stack[at:]
                    open_ -= component
                    yield component


def _open(number: int, order: dict[int, int], lowest: dict[int, int], stack: list[int], open_: set[int]) -> None:
    order[number] = lowest[number] = len(order)
    stack.append(number)
    open_.add(number)


def _after(after: Sequence[tuple[int, ...]], number: int) -> Iterator[int]:
    return iter(after[number] if number < len(after) else ())
