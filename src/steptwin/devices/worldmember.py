"""A world as a member of a composite subject: its answers are there at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from steptwin.jsonvalues import to_json
from steptwin.subject import commands as command
from steptwin.subject.contract import Description, PlannedSubject, Reading, Result
from steptwin.subject.jogs import Jogs
from steptwin.subject.subscriptions import Subscriptions


def present_of(world: PlannedSubject) -> dict[str, Any]:
    """``state`` by controller, ``faults``, ``workpieces`` and ``standing``."""
    states = {controller.name: world.do(command.ReadState(controller.name)).value for controller in world.description.controllers}
    pieces = [to_json(one) for one in world.workpieces()]
    faults, standing = world.do(command.ListFaults()).value, [to_json(one) for one in world.standing()]
    return {"state": states, "faults": faults, "workpieces": pieces, "standing": standing}


NOTHING_KNOWN: Mapping[str, Any] = {"state": {}, "faults": [], "workpieces": [], "standing": []}
"""As `present_of` where there is no world."""


class WorldMember:
    """Satisfies `steptwin.devices.composite.MemberSubject`."""

    lost = None

    def __init__(self, world: PlannedSubject, subscribers: Subscriptions, jogs: Jogs) -> None:
        self._world = world
        self.subscribers = subscribers
        self.do, self.plans = world.answer, world.plans
        self.workpieces, self.standing = world.workpieces, world.standing
        self.begin_jog = jogs.begin_jog

    @property
    def description(self) -> Description:
        return self._world.description

    def read(self, *points: str) -> tuple[Reading, ...]:
        return self._world.read(*points)

    def result_of(self, value: object) -> Result:
        """The result of a request that is not a command of the world, at its present moment."""
        return self._world.do(command.Time())._replace(value=value)

    def present(self) -> dict[str, Any]:
        return present_of(self._world)

    def selected(self, data: bytes) -> None:
        """Its lines take characters as they are."""
