"""Requests of the control endpoint of a world: pins, buttons, power, encoders, faults, state.

``unit`` is the name of a machine; pins are ``MACHINE.PIN``, buttons go by their names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from steptwin.errors import Misuse
from steptwin.live.cell import Cell
from steptwin.live.control import Handler, axis_number, changes, number, texts
from steptwin.mic488.device import Mic488
from steptwin.words.m1486_state import state_of as state_of_chip
from steptwin.words.mic488_state import state_of
from steptwin.world import script as do
from steptwin.world.actions import Outside
from steptwin.world.faults import read as read_fault
from steptwin.world.references import check_step

if TYPE_CHECKING:
    from steptwin.live.world import LiveWorld


class WorldControl:
    """What can be requested of a live world."""

    def __init__(self, cell: Cell, live: LiveWorld) -> None:
        self._cell = cell
        self._live = live
        self._world = live.world

    def handlers(self) -> dict[str, Handler]:
        return {
            "pin": self._at_present(self._pin),
            "state": self._at_present(self._state),
            "power-cycle": self._at_present(self._power_cycle),
            "encoder": self._at_present(self._encoder),
            "fault": self._at_present(self._fault),
        }

    def _at_present(self, action: Handler) -> Handler:
        """The action with the world at the present moment, and woken up for what it leads to."""

        def handle(request: Mapping[str, Any]) -> object:
            self._cell.enter()
            try:
                return action(request)
            finally:
                self._live.stale = True
                self._cell.leave()

        return handle

    def _take(self, steps: Sequence[Outside]) -> None:
        """Take all steps or none. Raises `Misuse`."""
        for step in steps:
            check_step(self._world, step)
        for step in steps:
            self._live.outside(step)

    def _chosen(self, unit: object, pin: str | None = None) -> str:
        """The machine meant, which is the only one where none is named. Raises `Misuse`."""
        machines = self._world.machines
        wanted = "" if unit is None else str(unit)
        if not wanted and len(machines) == 1:
            return next(iter(machines))
        for name in machines:
            if name.upper() == wanted.upper():
                return name
        known = ", ".join(machines)
        if pin is not None and not wanted:
            buttons = ", ".join(self._world.plan.buttons) or "none"
            raise Misuse(f"{pin}: give a pin as MACHINE.PIN; machines are {known}; buttons are {buttons}")
        raise Misuse(f"no machine {wanted!r}: machines are {known}" if wanted else f"choose a machine with --unit: {known}")

    # ------------------------------------------------------------------ requests

    def _pin(self, request: Mapping[str, Any]) -> object:
        """All changes or none, then the pins of the machine that is named, or of all."""
        unit, world = request.get("unit"), self._world
        self._take([self._pin_step(name, number(name, value), unit) for name, value in changes(request).items()])
        shown = list(world.machines) if unit is None else [self._chosen(unit)]
        for name in shown:
            world.touch(name)
        return {f"{name}.{pin}": value for name in shown for pin, value in world.machines[name].pins().items()}

    def _pin_step(self, name: str, level: float, unit: object) -> do.Set | do.Press | do.Release:
        if "." in name:
            owner, _, pin = name.rpartition(".")
            return do.Set(((self._chosen(owner), pin.upper(), level),))
        button = next((one for one in self._world.plan.buttons if one.upper() == name.upper()), None)
        if button is None:
            return do.Set(((self._chosen(unit, name), name.upper(), level),))
        if level not in (0, 1):
            raise Misuse(f"{button} = {level:g}: a button takes 1 (pressed) and 0 (released)")
        return do.Press(button) if level else do.Release(button)

    def _state(self, request: Mapping[str, Any]) -> object:
        name = self._chosen(request.get("unit"))
        self._world.touch(name)
        machine, now = self._world.machines[name], self._world.now
        return state_of(machine, now) if isinstance(machine, Mic488) else state_of_chip(machine, now)

    def _power_cycle(self, request: Mapping[str, Any]) -> None:
        self._live.outside(do.PowerCycle(self._chosen(request.get("unit"))))

    def _encoder(self, request: Mapping[str, Any]) -> object:
        """Turn shafts by counts, all of them or none, then the shafts of the machine."""
        name = self._chosen(request.get("unit"))
        device = self._world.controller(name, "encoder")
        turns: list[do.Turn] = []
        for axis, change in changes(request).items():
            if not isinstance(change, int) or isinstance(change, bool):
                raise Misuse(f"M{axis} = {change!r}: expected +N or -N counts; the world's file sets what turns an encoder")
            turns.append(do.Turn(name, axis_number(axis), change))
        self._take(turns)
        now = self._world.touch(name).now
        return [{"axis": a.number, "counts": a.encoder_counts(now), "turned_by": a.encoder.coupling.value} for a in device.axes]

    def _fault(self, request: Mapping[str, Any]) -> object:
        """Clear faults by name (true: all), then set those given as lines; all that are set then."""
        faults = self._world.plan.faults
        set_now = [active.name for active in faults.active]
        unwanted = set_now if request.get("clear") is True else list(dict.fromkeys(texts(request, "clear")))
        wanted = [read_fault(line) for line in texts(request, "set")]
        self._take([*map(do.ClearFault, unwanted), *map(do.SetFault, wanted)])
        return [{"name": a.name, "fault": str(a.fault), "happened": a.struck} for a in faults.active]
