"""The interface of a controller for a running program. The language depends on no particular controller."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

from steptwin.controller import Nanos
from steptwin.tables import IncompleteTable, complete
from steptwin.wbc.registers import RegisterRow

RegisterReader: TypeAlias = Callable[[Any, Nanos], float]
"""(controller, moment) → REAL. It holds for later moments, too, as long as no event occurs."""

RegisterWriter: TypeAlias = Callable[[Any, float, Nanos], bool]
"""(controller, REAL, moment) → whether that changed anything."""

Tendency: TypeAlias = Callable[[Any, Nanos], Iterable[Nanos] | None]
"""(controller, moment) → the trajectory of a register as long as no event occurs: the ends, in order, of the intervals
in which it only rises or only falls; after the last one it is constant. `FOREVER` ends an interval without end. None: not
known."""

FOREVER: Nanos = 2**62


@dataclass(frozen=True, slots=True)
class RegisterFamily:
    """A family of registers: what each function makes of the register's number.

    Values written are within what the register takes, whole where it is whole. ``quiet``: a write affects neither deadlines nor
    outputs. Registers without ``tendency`` change only when something happens.
    """

    read: Callable[[int], RegisterReader]
    write: Callable[[int], RegisterWriter] | None = None
    tendency: Callable[[int], Tendency] | None = None
    quiet: bool = True


def complete_access(rows: Mapping[str, RegisterRow], given: Mapping[str, RegisterFamily]) -> Mapping[str, RegisterFamily]:
    """``given``, read-only, by family in upper case. `IncompleteTable` for a register of the language without its access, an
    access without its register, and one that can be written where the register cannot or the other way round."""
    found = complete("register", rows, "access", given)
    for key, access in found.items():
        row = rows[key]
        if (access.write is None) is not (row.writes is None):
            problem = "lacks its write" if access.write is None else "has a write that its row does not permit"
            raise IncompleteTable(f"register {key} ({row.access}) {problem}")
    return found


class ProgramController(Protocol):
    """Actions of statements, each at the moment ``now``. Raises `steptwin.wbc.real.ProgramFault` for an impossible one."""

    def motion(self, keyword: str, axis: int, value: float, now: Nanos) -> None:
        """HOME, VABS, VREL, PABS, PREL of ``axis`` (from 1) in configured units."""
        ...

    def halt(self, keyword: str, axis: int, now: Nanos) -> None:
        """BRAKE, STOP."""
        ...

    def row_motion(self, keyword: str, row: float, now: Nanos) -> None:
        """A motion with the parameters of row ``row`` of the position table."""
        ...

    def at_rest(self, now: Nanos) -> bool:
        """Whether every enabled drive has finished (WBC-8)."""
        ...

    def pulse(self, output: int, duration: Nanos, now: Nanos) -> None:
        """PULSE of ``output`` (from 1)."""
        ...

    def end(self, now: Nanos) -> None:
        """END: the program is over, drives and outputs go off."""
        ...

    def reset(self, now: Nanos) -> None:
        """PROGRESET: drives go off, everything else that belongs to the program is as at its start."""
        ...
