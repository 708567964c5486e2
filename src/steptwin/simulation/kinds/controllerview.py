"""The view of a controller in a running world for Python programs, at the present moment."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.controllerstate import ControllerState
from steptwin.simulation.kinds.kind import RunningWorld
from steptwin.simulation.script import steps as do


class ControllerView:
    """The common part of all controllers' views."""

    def __init__(self, world: RunningWorld, name: str) -> None:
        self._world = world
        self.name = name

    def _sync(self) -> None:
        self._world.sync(self.name)

    @property
    def state(self) -> ControllerState:
        """Status, program, axes, pins and details."""
        return self._world.state_of(self.name)

    @property
    def pins(self) -> Mapping[str, float]:
        """The level of every pin: 0, 1, volts."""
        self._sync()
        return self._world.kind(self.name).state.pins(self._world.controllers[self.name], self._world.now)

    def set_pin(self, pin: str, value: float) -> None:
        """Set an input from outside: 0, 1, volts. Raises `Misuse`."""
        self._world.apply_input(do.Set(((self.name, pin.upper(), float(value)),)))

    def power_cycle(self) -> None:
        """Switch it off and on again."""
        self._world.apply_input(do.PowerCycle(self.name))
