"""``[[conveyor.sensor]]``: a contact that is on while a workpiece, or a mark on one, is at its place of a belt."""

from __future__ import annotations

from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.components.contact import ContactSpec
from steptwin.simulation.logic.contacts import Circuit, Contact
from steptwin.simulation.mechanics.belt import Belt
from steptwin.simulation.scheduler.chance import Chance
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import INPUT_PIN, Terminal, number, word

WORKPIECE, MARK = "workpiece", "mark"


@table("[[conveyor.sensor]]")
class SensorSpec(ContactSpec):
    """A light barrier, proximity switch or mark sensor over the belt."""

    at: float = key(number(0.0), "mm from the beginning of the belt", order=-1)
    target: Terminal = key(INPUT_PIN, "the input, on while a workpiece covers it: CONTROLLER.PIN", name="to")
    sees: str = key(word(WORKPIECE, MARK), "workpiece, or the marks on workpieces", default=WORKPIECE)


class Sensor(Contact):
    """On while a workpiece, or a mark on one, covers its place."""

    FIXED: ClassVar[tuple[str, ...]] = ("_at", "_belt", "_seen", "at_mm", "of_marks")
    __slots__ = (*FIXED,)

    def __init__(self, circuit: Circuit, belt: Belt, spec: SensorSpec, chance: Chance, channel: str) -> None:
        super().__init__(
            circuit,
            normally_closed=spec.contact == "NC",
            bounce_ns=spec.bounce,
            bounces=spec.bounces,
            chance=chance,
            channel=channel,
        )
        self._belt = belt
        self.at_mm = spec.at
        self._at = belt.to_grid(spec.at)
        self.of_marks = spec.sees == MARK
        self._seen: object = None
        self.rest_at(self.normally_closed)

    def update(self, now: Nanos) -> None:
        self.bounce(now)
        belt = self._belt
        version = belt.version_at(self._at)
        if version == self._seen and (self._due is None or self._due > now):
            return
        self._seen = version
        self.change((self._occupant(now) != "") is not self.normally_closed, now)
        self._due = belt.next_change(self._at, now, of_marks=self.of_marks)

    def _occupant(self, now: Nanos) -> str:
        found = self._belt.occupant(self._at, self._at, now, of_marks=self.of_marks)
        return "" if found is None else found[1].workpiece.name

    def by(self, now: Nanos) -> str:
        """The workpiece that it sees, or has just seen; empty for one that is not on the belt any more."""
        return self._occupant(now) or self._occupant(now - 1)

    def deadline(self) -> Nanos | None:
        moments = (moment for moment in (self.bounce_due(), self._due) if moment is not None)
        return min(moments, default=None)
