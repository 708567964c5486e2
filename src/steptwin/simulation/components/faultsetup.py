"""The faults of a world: checks of their places, and preparation of controllers for them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from steptwin.controller import Nanos
from steptwin.simulation.components.axis import AXIS
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.faults import ActiveFault, Fault, RequestRoute, check_route, prepare_for_faults
from steptwin.simulation.faults.controller import FaultyController
from steptwin.simulation.faults.table import Layer, Occasion
from steptwin.simulation.kinds.kind import LineUnit
from steptwin.simulation.kinds.lines import SCRIPTS
from steptwin.simulation.kinds.registry import line_kinds


class FaultSetup:
    """Sets the faults of a world that was built from a description."""

    def __init__(self, plan: BuiltObjects) -> None:
        self._plan = plan

    def check(self, fault: Fault) -> None:
        """Raises `Misuse` for a fault at a place that does not exist, or where it is impossible."""
        check_route(fault, [*_wires(self._plan)])
        self._prepare(fault)
        self._plan.faults.check(fault)

    def put(self, fault: Fault, now: Nanos) -> None:
        """Set a fault; schedulers are at ``now``. Raises as `check`."""
        self.check(fault)
        self._plan.faults.add(fault, now)

    def put_back(self, faults: Iterable[tuple[Fault, str, Nanos]], prepared: Iterable[str], state: Any) -> None:
        """Restore the faults of a snapshot, with name and moment, and prepare the controllers that it has prepared; others remain
        prepared for later ones."""
        kept, there = list(faults), self._plan.faults
        for name in prepared:
            self.prepare_for_faults(name)
        there.active = tuple(ActiveFault(fault, name, there.seed, since) for fault, name, since in kept)
        there.set_state(state)

    def _prepare(self, fault: Fault) -> None:
        if fault.kind.layer is Layer.PHYSICS or fault.kind.occasion is Occasion.REQUEST:
            for name in self._plan.controllers:
                self.prepare_for_faults(name)

    def prepare_for_faults(self, name: str) -> FaultyController:
        """Prepare a controller for faults; if an axis has mechanics, its faults act on these instead of on the encoder."""
        plan = self._plan
        controller, scheduler = plan.controllers[name], plan.scheduler_of[name]
        prepared = scheduler.controllers[name]
        if isinstance(prepared, FaultyController):
            return prepared
        mechanisms = {axis.mechanism.number: axis.mechanism for axis in plan.built(AXIS).values() if axis.spec.drive[0] == name}
        on = plan.line_of.get(name)
        service = LineUnit() if on is None else LineUnit(on[1], on[0].name)
        body = plan.kind_of[name].body(controller, service, mechanisms)
        return prepare_for_faults(scheduler, name, plan.faults, body)


def _wires(plan: BuiltObjects) -> Iterator[RequestRoute]:
    """The routes of requests: external links of lines, described or present; scripts; None for a controller without a line."""
    for spec in plan.line_specs:
        line = plan.lines.get(spec.name)
        if line is None:
            continue  # something is wrong with it
        kind, name = line_kinds()[spec.kind], f"line {spec.name!r} carries"
        opened = kind.opened_by
        links = {opened[key].client: opened[key].client_kind for key in spec.links}
        outside = [
            RequestRoute(name, line.fault_kinds[client_kind], link, line.units, on=spec.name)
            for link, client_kind in links.items()
        ]
        for client, there in line.clients.items():
            if client != SCRIPTS and not any(wire.is_called(client) for wire in outside):
                outside.append(RequestRoute(name, line.fault_kinds[there.kind], client, line.units, on=spec.name))
        yield from outside
        yield RequestRoute(name, line.fault_kinds[line.kinds[0]], SCRIPTS, line.units, is_usual=not outside, on=spec.name)
    for name, kind in plan.kind_of.items():
        if kind.registers is not None and name not in plan.line_of:
            yield RequestRoute(f"{name!r} is on no line", None, units=(LineUnit().unit,))
