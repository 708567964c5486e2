"""Where axes are, computed from the plans that were followed: no subject is asked for positions."""

from __future__ import annotations

from collections.abc import Iterable

from steptwin.controller import Nanos
from steptwin.motion.divisions import Plan, profile_of
from steptwin.subject.contract import ControllerDescription
from steptwin.subject.events import Event
from steptwin.subject.payloads import CoordinatePayload, PlanPayload


class Motions:
    """The axes of a controller; ``plans`` are those that hold when following begins."""

    def __init__(self, controller: ControllerDescription, plans: Iterable[Event]) -> None:
        self._controller = controller.name
        self._scales = {str(axis.number): axis.pulses_per_unit or 1.0 for axis in controller.datasheet.axes}
        self._rounds = {str(axis.number): axis.round_p for axis in controller.datasheet.axes}
        self._plans: dict[str, Plan] = {}
        self._origins: dict[str, int] = {}
        for plan in plans:
            self.take(plan)

    def take(self, event: Event) -> None:
        if event.controller != self._controller:
            return
        match event.payload:
            case PlanPayload(axis, plan, origin):
                self._plans[axis] = plan
                if origin is not None:
                    self._origins[axis] = origin
            case CoordinatePayload(axis, origin):
                self._origins[axis] = origin

    def position(self, axis: str, now: Nanos) -> float:
        """Counted, as the controller shows it, in units of the axis."""
        count, round_p = self._plans[axis].count(now) + self._origins.get(axis, 0), self._rounds[axis]
        if round_p is not None:
            count = (count + round_p // 2) % round_p - round_p // 2
        return count / self._scales[axis]

    def velocity(self, axis: str, now: Nanos) -> float:
        return profile_of(self._plans[axis]).velocity(now) / self._scales[axis]

    def is_moving(self, now: Nanos) -> bool:
        return any(profile_of(plan).moving(now) for plan in self._plans.values())
