"""``[[conveyor.sensor]]``: a contact that is on while a workpiece, or a mark on one, is at its place of a belt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeVar

from steptwin.machine import Nanos
from steptwin.simulation.components.contact import CONTACT_KEYS
from steptwin.simulation.logic.contacts import Circuit, Contact
from steptwin.simulation.mechanics.belt import BeltDrive, Load, next_change
from steptwin.simulation.scheduler.chance import Chance
from steptwin.simulation.toml.reader import Key, Table, TomlText, optional, read_table
from steptwin.simulation.toml.sense import TableRows, check_sense
from steptwin.simulation.toml.tomlplaces import Path
from steptwin.simulation.toml.values import INPUT_PIN, Terminal, number, word

WORKPIECE, MARK = "workpiece", "mark"
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSpec:
    """A light barrier, proximity switch or mark sensor over the belt."""

    at: float
    sees: str
    target: Terminal
    contact: str
    join: str | None
    bounce: Nanos
    bounces: int
    path: Path = ()


SENSOR = TableRows(
    written="[[conveyor.sensor]]",
    keys=(
        Key("at", number(0.0), "mm from the beginning of the belt"),
        Key("to", INPUT_PIN, "the input, on while a workpiece covers it: MACHINE.PIN", attribute="target"),
        optional(word(WORKPIECE, MARK), "sees", "workpiece, or the marks on workpieces", WORKPIECE),
        *CONTACT_KEYS,
    ),
    need={"bounces": "bounce"},
)


def read_inner(
    text: TomlText, path: Path, table: Table, key: str, rows: TableRows, make: Callable[..., T], needed: tuple[str, ...]
) -> tuple[T, ...]:
    """The tables ``key`` in a table, those that have what they need."""
    given = table.get(key, [])
    found: list[T] = []
    for n, one in enumerate(given if isinstance(given, list) else [given]):
        of_one = (*path, key, n)
        values = read_table(text, of_one, one, rows.keys)
        if all(attribute in values for attribute in needed):
            check_sense(text, of_one, rows, one)
            found.append(make(**values, path=of_one))
    return tuple(found)


class Carrying(Protocol):
    """A belt with its workpieces."""

    drive: BeltDrive
    load: Load

    def version(self) -> object:
        """Another value whenever predictions no longer hold."""
        ...

    def places(self, mm: float) -> int: ...


class Sensor(Contact):
    """On while a workpiece, or a mark on one, covers its place."""

    FIXED: ClassVar[tuple[str, ...]] = ("_at", "_belt", "_of_marks", "_seen")
    __slots__ = (*FIXED,)

    def __init__(self, circuit: Circuit, belt: Carrying, spec: SensorSpec, chance: Chance, lane: str) -> None:
        super().__init__(
            circuit,
            normally_closed=spec.contact == "NC",
            bounce_ns=spec.bounce,
            bounces=spec.bounces,
            chance=chance,
            lane=lane,
        )
        self._belt = belt
        self._at = belt.places(spec.at)
        self._of_marks = spec.sees == MARK
        self._seen: object = None
        self.rest_at(self.normally_closed)

    def update(self, now: Nanos) -> None:
        self.bounce(now)
        version = self._belt.version()
        if version == self._seen and (self._due is None or self._due > now):
            return
        self._seen = version
        drive, load = self._belt.drive, self._belt.load
        place = drive.place(now)
        is_seen = load.covering(self._at, place, of_marks=self._of_marks) is not None
        self.change(is_seen is not self.normally_closed, now)
        self._due = next_change(drive, *load.edges(self._at, place, of_marks=self._of_marks), now)

    def deadline(self) -> Nanos | None:
        moments = (moment for moment in (self.bounce_due(), self._due) if moment is not None)
        return min(moments, default=None)
