"""The user registers as numbers of a type."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, TypeVar, cast

from steptwin.controller import MILLISECOND, Nanos
from steptwin.drivers.mic488.unit import Unit
from steptwin.mic488.values import UserFormat

Number = TypeVar("Number", int, float)

MEMORY_NS: Nanos = 3000 * MILLISECOND
"""Time for non-volatile memory, ns."""


class AsyncUserView(Generic[Number]):
    """User registers as WORD (0…65535), INT (signed), DINT or REAL; DINT and REAL take two, from an even number on."""

    def __init__(self, unit: Unit, view: UserFormat) -> None:
        self._unit = unit
        self._view = view

    async def read(self, number: int) -> Number:
        """The value at user register ``number``."""
        return cast(Number, (await self._unit.read_user(number, self._view, 1))[0])

    async def read_many(self, number: int, count: int) -> list[Number]:
        """``count`` values from user register ``number`` on."""
        return cast("list[Number]", await self._unit.read_user(number, self._view, count))

    async def write(self, number: int, value: Number) -> None:
        await self._unit.write_user(number, self._view, [value])

    async def write_many(self, number: int, values: Sequence[Number]) -> None:
        """Write values from user register ``number`` on, up to 61 DINTs or REALs or 122 others at one moment."""
        await self._unit.write_user(number, self._view, values)


class AsyncUserRegisters:
    """The user registers, by type, and their non-volatile copy (firmware 1.70: registers 1000 to 1999)."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self.words: AsyncUserView[int] = AsyncUserView(unit, UserFormat.WORD)
        self.ints: AsyncUserView[int] = AsyncUserView(unit, UserFormat.INT)
        self.dints: AsyncUserView[int] = AsyncUserView(unit, UserFormat.DINT)
        self.reals: AsyncUserView[float] = AsyncUserView(unit, UserFormat.REAL)

    async def save(self) -> None:
        """Copy registers 1000–1999 to non-volatile memory. Raises `Misuse` where the firmware has none."""
        await self._act("USER_REG_SAVE")

    async def load(self) -> None:
        """Copy the non-volatile memory to registers 1000–1999."""
        await self._act("USER_REG_READ")

    async def zero(self) -> None:
        """Set registers 1000–1999 to 0; their non-volatile copy stays."""
        await self._act("USER_REG_ZERO")

    async def _act(self, key: str) -> None:
        await self._unit.write(self._unit.item(key), True, timeout_ns=max(MEMORY_NS, self._unit.timeout_ns))
