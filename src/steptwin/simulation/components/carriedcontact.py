"""A workpiece that a cup or jaws carry against something."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from steptwin.controller import Nanos
from steptwin.simulation.components.bodycontact import BodyContact, SweptBody, while_there
from steptwin.simulation.components.grasp import Grasp
from steptwin.simulation.components.probe import Probe
from steptwin.simulation.components.workpieces import REACH_NM, Workpieces
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.space.bodies import Body, Box, Cylinder


class CarriedContact:
    """A `steptwin.simulation.components.touch.Meeting` of what is carried, whatever that is, with parts of the machine and with
    workpieces."""

    __slots__ = ("_among", "_carried", "_parts", "_probe", "_workpieces", "grasp")

    def __init__(
        self,
        grasp: Grasp,
        parts: Mapping[str, tuple[SweptBody, Sequence[SignalCondition]]],
        workpieces: Workpieces | None,
        among: Callable[[Body], Body | None],
    ) -> None:
        """``parts``: with the conditions under which they are there; ``among``: what it may touch of a workpiece."""
        self.grasp = grasp
        self._parts = parts
        self._workpieces = workpieces
        self._among = among
        self.forget()

    def forget(self) -> None:
        self._carried: Body | None = None
        self._probe: Probe | None = None
        for _, conditions in self._parts.values():
            for one in conditions:
                one.forget()

    def _of_carried(self) -> Probe | None:
        carried = next(iter(self.grasp.bodies().values()), None)
        if carried is not self._carried:
            self._carried, self._probe = carried, None
            if carried is not None:
                body = _without_bottom(carried)
                swept = SweptBody(body)
                contacts = {name: while_there(BodyContact(swept, part), whens) for name, (part, whens) in self._parts.items()}
                self._probe = Probe(body, contacts, self._workpieces, self._among)
        return self._probe

    def holds(self, now: Nanos) -> bool:
        probe = self._of_carried()
        return probe is not None and probe.holds(now)

    def change(self, now: Nanos) -> Nanos | None:
        probe = self._of_carried()
        return None if probe is None else probe.change(now)

    def told(self, now: Nanos) -> tuple[str, str]:
        """The name of what is carried, and those of what it touches."""
        probe, carried = self._of_carried(), self._carried
        if probe is None or carried is None:
            return self.grasp.name, ""
        return carried.name, ", ".join(probe.met(now))


def _without_bottom(body: Body) -> Body:
    """A workpiece without as much of its bottom as may be pressed into what it is put on."""
    x, y, z = body.centre
    shape = body.shape
    half = max((shape.half[2] if isinstance(shape, Box) else shape.half) - REACH_NM // 2, 0)
    smaller = Box((*shape.half[:2], half)) if isinstance(shape, Box) else Cylinder(shape.radius, half)
    return Body(body.name, body.frame, smaller, (x, y, z + REACH_NM // 2))
