"""An M1486 of a running world for Python programs."""

from __future__ import annotations

from steptwin.m1486.chip import M1486Chip
from steptwin.simulation.kinds.controllerview import ControllerView
from steptwin.simulation.kinds.kind import RunningWorld


class M1486View(ControllerView):
    """An M1486. Positions in minimum microsteps."""

    def __init__(self, world: RunningWorld, name: str, chip: M1486Chip) -> None:
        super().__init__(world, name)
        self.chip = chip

    @property
    def position(self) -> int:
        """Where the pulses given so far have led, since power-on."""
        self._sync()
        return self.chip.drive.true_u(self._world.now)

    @property
    def counter(self) -> int:
        """The position counter, 24 bits."""
        self._sync()
        return self.chip.drive.counter_u(self._world.now)

    @property
    def moving(self) -> bool:
        self._sync()
        return self.chip.drive.is_busy
