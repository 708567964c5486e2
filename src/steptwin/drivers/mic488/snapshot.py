"""A snapshot of all registers that can be read and written, and its restoration.

Triggers and PROGRAM_CTRL, which act when written, are not part of it. Counters (positions, encoders) and outputs are
included but restored only on demand: writing a counter does not move the machine, and an output may move something.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from steptwin.drivers.mic488.failures import NotReady
from steptwin.drivers.mic488.motion import MOVING, status_text
from steptwin.drivers.mic488.unit import Unit
from steptwin.errors import Misuse
from steptwin.mic488.registermap import DataType, Register, Type, WriteEffect
from steptwin.mic488.values import RegisterItem, RegisterValue, UserFormat, encoded

FORMAT = "steptwin MIC488 snapshot 1"
COUNTERS = ("POS_ACT", "ENC_IMP", "ENC_XPOS")
_OUTPUTS = ("OUT",)


@dataclass(frozen=True, slots=True)
class Mic488Snapshot:
    """Values by name, in the form of ``data_type``; user registers as words, without trailing zeros."""

    firmware: str
    data_type: DataType
    values: Mapping[str, RegisterValue]
    user: tuple[int, ...]

    def to_json(self) -> str:
        data = {
            "format": FORMAT,
            "firmware": self.firmware,
            "data_type": self.data_type.name,
            "values": dict(self.values),
            "user_registers": list(self.user),
        }
        return json.dumps(data, indent=2)

    @classmethod
    def from_json(cls, text: str) -> Mic488Snapshot:
        """The snapshot in a JSON text. Raises `Misuse` for other text. Values are checked later, when they are written to a
        controller."""
        try:
            data: dict[str, Any] = json.loads(text)
            if data["format"] != FORMAT:
                raise Misuse(f"the format is {data['format']!r}, expected {FORMAT!r}")
            values = {name: _checked(name, value, bool | int | float) for name, value in data["values"].items()}
            user = tuple(_checked(f"USER_REGISTER[{n}]", word, int) for n, word in enumerate(data["user_registers"]))
            return cls(str(data["firmware"]), DataType[data["data_type"]], values, user)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            if isinstance(error, Misuse):
                raise
            raise Misuse(f"this is not a snapshot of a MIC488 ({type(error).__name__}: {error})") from None


def _checked(name: str, value: Any, kind: Any) -> Any:
    if not isinstance(value, kind):
        raise Misuse(f"the snapshot has {name} = {json.dumps(value)}: expected a number")
    return value


class SnapshotChange(NamedTuple):
    """A change by restoring a snapshot; ``old`` is None if not comparable (another DATA_TYPE)."""

    item: RegisterItem
    old: RegisterValue | None
    new: RegisterValue

    def __str__(self) -> str:
        return f"{self.item.name}: {'?' if self.old is None else _text(self.old)} → {_text(self.new)}"


def _text(value: RegisterValue) -> str:
    return ("ON" if value else "OFF") if isinstance(value, bool) else f"{value:.9g}"


def _kept(register: Register) -> bool:
    return bool(register.reads) and register.effect is WriteEffect.STORE and register.type is not Type.MEMORY


async def take(unit: Unit) -> Mic488Snapshot:
    """Take a snapshot."""
    data_type = (await unit.control()).data_type
    items = [RegisterItem(register) for register in unit.registers if _kept(register)]
    values = await unit.read(items, data_type)
    count = unit.registers.firmware.user_registers
    user = [int(word) for word in await unit.read_user(0, UserFormat.WORD, count)]
    while user and user[-1] == 0:
        user.pop()
    return Mic488Snapshot(unit.registers.firmware.name, data_type, {item.name: values[item] for item in items}, tuple(user))


async def changes(unit: Unit, snapshot: Mic488Snapshot, *, counters: bool, outputs: bool) -> list[SnapshotChange]:
    """The changes that `put_back` would write. Raises `Misuse` for a snapshot of another firmware, or with invalid values."""
    if snapshot.firmware != unit.registers.firmware.name:
        raise Misuse(f"the snapshot is of firmware {snapshot.firmware}, this controller has {unit.registers.firmware.name}")
    memory = unit.registers.of("USER_REGISTER")
    if len(snapshot.user) > memory.cells:
        raise Misuse(f"the snapshot has {len(snapshot.user)} user registers, this controller {memory.cells}")
    present = await take(unit)
    left_out = (() if counters else COUNTERS) + (() if outputs else _OUTPUTS)
    comparable = present.data_type is snapshot.data_type
    found: list[SnapshotChange] = []
    for name, new in snapshot.values.items():
        register = unit.registers.named(name)
        if register.key in left_out or not _kept(register):
            continue
        old = present.values.get(name) if comparable or register.type is not Type.VALUE else None
        if old != new:
            found.append(SnapshotChange(RegisterItem(register), old, new))
    # Values mean something only with the DATA_TYPE they were read with.
    found.sort(key=lambda change: change.item.register.key != "DATA_TYPE")
    for number in range(max(len(snapshot.user), len(present.user))):
        old, new = (words[number] if number < len(words) else 0 for words in (present.user, snapshot.user))
        if old != new:
            found.append(SnapshotChange(RegisterItem(memory, number), old, new))
    for change in found:  # all of them before the first is written
        encoded(change.item, change.new, snapshot.data_type)
    return found


async def put_back(unit: Unit, snapshot: Mic488Snapshot, *, counters: bool, outputs: bool) -> list[SnapshotChange]:
    """Write the differences and verify them. Raises `NotReady` while an axis moves, or if a value was not kept."""
    control = await unit.control()
    moving = [f"M{axis} ({status_text(code)})" for axis, code in enumerate(control.axes, start=1) if code in MOVING]
    if moving:
        raise NotReady(unit.place, f"nothing is restored while axes move: {', '.join(moving)}")
    wanted = await changes(unit, snapshot, counters=counters, outputs=outputs)
    for change in wanted:
        if change.item.register.type is not Type.MEMORY:
            await unit.write(change.item, change.new, data_type=snapshot.data_type)
    for first, values in _runs([change for change in wanted if change.item.register.type is Type.MEMORY]):
        await unit.write_user(first, UserFormat.WORD, values)
    left = await changes(unit, snapshot, counters=counters, outputs=outputs)
    if left:
        raise NotReady(unit.place, f"not kept by the controller: {'; '.join(map(str, left))}")
    return wanted


def _runs(changed: list[SnapshotChange]) -> list[tuple[int, list[RegisterValue]]]:
    """Groups of consecutive user registers."""
    runs: list[tuple[int, list[RegisterValue]]] = []
    for change in changed:
        if runs and runs[-1][0] + len(runs[-1][1]) == change.item.cell:
            runs[-1][1].append(change.new)
        else:
            runs.append((change.item.cell, [change.new]))
    return runs
