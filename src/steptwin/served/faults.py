"""Faults of a served twin: given when it is started, set and removed while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from steptwin.errors import Misuse
from steptwin.live.cell import Cell
from steptwin.live.control import Handler, texts
from steptwin.machine import Nanos
from steptwin.world.faults import Active, Body, Fault, Faults, Line, Wire, check_place, read, rig
from steptwin.world.kernel import Kernel
from steptwin.world.trace import Record


class FaultDesk:
    """The faults of the machines of a kernel and of the ports that are made for them.

    Until there is a fault, ports are served as they are and the machines stand alone. ``bodies`` makes what can fail of each
    machine. `Misuse` for a fault that cannot be set.
    """

    def __init__(self, kernel: Kernel, bodies: Mapping[str, Callable[[], Body]]) -> None:
        self.faults = Faults()
        self.lines: set[Line] = set()
        """What is served, where that is known."""
        self._kernel = kernel
        self._bodies = bodies

    def start(self, lines: Sequence[str], seed: int) -> None:
        """Set the faults that were given with the command."""
        self.faults.seed = seed
        for line in lines:
            self._add(read(line), self._kernel.now)

    def tell(self, notice: Callable[[str], None]) -> None:
        """Let ``notice`` know in words what happens."""

        def told(record: Record) -> None:
            if record.kind == "fault":
                notice(f"fault {record.subject}, {record.machine}: {record.value}")

        self.faults.sinks.append(told)

    def handler(self, cell: Cell) -> Handler:
        """Request of the control endpoint: ``set`` (lines) and ``clear`` (names, or true for all there were), all of it or
        nothing; answers what is set then."""

        def handle(request: Mapping[str, Any]) -> object:
            wanted, unwanted = texts(request, "set"), request.get("clear")
            there = [active.name for active in self.faults.active]
            names = there if unwanted is True else list(dict.fromkeys(texts(request, "clear")))
            for name in names:
                if name not in there:
                    raise Misuse(f"no fault {name!r}: set are {', '.join(there) or 'none'}")
            now = cell.enter()
            try:
                self._add_all([read(line) for line in wanted], now)
                for name in names:
                    self.faults.remove(name, now)
            finally:
                cell.leave()
            return [_shown(active) for active in self.faults.active]

        return handle

    def _add_all(self, faults: Sequence[Fault], now: Nanos) -> None:
        before = len(self.faults.active)
        try:
            for fault in faults:
                self._add(fault, now)
        except Misuse:
            for active in self.faults.active[before:]:
                self.faults.remove(active.name, now)
            raise

    def _add(self, fault: Fault, now: Nanos) -> None:
        units = tuple(int(name) for name in self._bodies if name.isdecimal())
        check_place(fault, [Wire("this twin serves", line, units=units) for line in sorted(self.lines or Line)])
        for name, body in self._bodies.items():
            if name not in self.faults.machines:
                rig(self._kernel, name, self.faults, body())
        self.faults.add(fault, now)


def _shown(active: Active) -> dict[str, object]:
    return {"name": active.name, "fault": str(active.fault), "seen": active.seen, "happened": active.struck}
