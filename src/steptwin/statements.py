"""Hooks on the statements of programs: one contract for the languages of all controllers.

A hook is called before each statement is executed, with its moment and its number: the step of a WBC program, the place of an
M1486 command in its memory. It must not change the controller. A WAIT that looks again is not executed again, and what a
controller skips while a program rests is not executed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos

StatementHook: TypeAlias = Callable[[Nanos, int], None]


class HookedStatements(NamedTuple):
    """A hook and the numbers of the statements before which it is called; None: before all. The others run at full speed."""

    hook: StatementHook
    numbers: Collection[int] | None = None

    def has(self, number: int) -> bool:
        return self.numbers is None or number in self.numbers


StatementHooks: TypeAlias = tuple[HookedStatements, ...]
"""The hooks of one controller, in the order in which they are called."""


def hook_before(hooks: StatementHooks, number: int) -> StatementHook | None:
    """One hook that calls all hooks of a statement; None without any."""
    found = tuple(one.hook for one in hooks if one.has(number))
    if len(found) <= 1:
        return found[0] if found else None

    def call(now: Nanos, number: int) -> None:
        for hook in found:
            hook(now, number)

    return call


def without(hooks: StatementHooks, hook: StatementHook) -> StatementHooks:
    """The hooks except ``hook``."""
    return tuple(one for one in hooks if one.hook != hook)
