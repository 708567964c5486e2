"""States of a world that are kept under names, to go back to them."""

from __future__ import annotations

from itertools import count

from steptwin.errors import Misuse
from steptwin.messages import NONE, Message
from steptwin.nearmiss import NearMiss
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.subject.commands import DropSnapshot, RestoreSnapshot, TakeSnapshot

MOST_SNAPSHOTS = 32


TOO_MANY_SNAPSHOTS = Message("subject.too-many-snapshots", "{most} snapshots are kept, as many as may be: drop one: {names}")
UNKNOWN_SNAPSHOT = Message("subject.unknown-snapshot", "no snapshot is called {name!r}{hint}; there are {names}")


class Snapshots:
    """At most `MOST_SNAPSHOTS`, in the order in which they were taken."""

    def __init__(self) -> None:
        self._kept: dict[str, SimulationSnapshot] = {}

    def add(self, wanted: TakeSnapshot, snapshot: SimulationSnapshot) -> dict[str, object]:
        """Raises `Misuse` where there are too many."""
        name = wanted.name
        if name is None:
            name = next(text for number in count(1) if (text := str(number)) not in self._kept)
        if name not in self._kept and len(self._kept) >= MOST_SNAPSHOTS:
            raise Misuse(TOO_MANY_SNAPSHOTS(most=MOST_SNAPSHOTS, names=list(self._kept)))
        self._kept.pop(name, None)
        self._kept[name] = snapshot
        return _to_json(name, snapshot)

    def to_json(self) -> list[dict[str, object]]:
        return [_to_json(name, snapshot) for name, snapshot in self._kept.items()]

    def find(self, wanted: RestoreSnapshot | DropSnapshot) -> SimulationSnapshot:
        """Raises `Misuse` with those there are."""
        found = self._kept.get(wanted.name)
        if found is None:
            hint = NearMiss().hint(wanted.name, self._kept)
            raise Misuse(UNKNOWN_SNAPSHOT(name=wanted.name, hint=hint, names=list(self._kept) or NONE()))
        return found

    def drop(self, wanted: DropSnapshot) -> None:
        """Raises `Misuse` as `find`."""
        self.find(wanted)
        del self._kept[wanted.name]


def _to_json(name: str, snapshot: SimulationSnapshot) -> dict[str, object]:
    return {"name": name, "time_ns": str(snapshot.now)}
