"""Hooks on the statements of programs: one contract for the languages of all controllers.

A hook is called before each statement is executed, with its moment and its number: the step of a WBC program, the place of an
M1486 command in its memory. It must not change the machine. A WAIT that looks again is not executed again, and what a machine
skips while a program rests is not executed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from steptwin.machine import Nanos

StatementHook: TypeAlias = Callable[[Nanos, int], None]
StatementHooks: TypeAlias = tuple[StatementHook, ...]
"""The hooks of one machine, in the order of their calls."""


def joined(hooks: StatementHooks) -> StatementHook:
    """One hook that calls all ``hooks``, of which there is at least one."""
    if len(hooks) == 1:
        return hooks[0]

    def call(now: Nanos, number: int) -> None:
        for hook in hooks:
            hook(now, number)

    return call


def without(hooks: StatementHooks, hook: StatementHook) -> StatementHooks:
    """The hooks without ``hook``."""
    return tuple(one for one in hooks if one != hook)
