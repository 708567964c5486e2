"""Views of a running world for Python programs: its controllers, its mechanics and lines, at the present moment.

Positions in the units of the axis, times in seconds, torques in N·m.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Generic, TypeVar

from steptwin.simulation.components.axis import BuiltAxis
from steptwin.simulation.world.inputs import Bytes
from steptwin.simulation.world.simulation import Simulation

View = TypeVar("View")


class Views(Mapping[str, View], Generic[View]):
    """Views by name. An unknown name raises `Misuse` with the existing ones."""

    def __init__(self, simulation: Simulation, what: str, views: Mapping[str, View]) -> None:
        self._simulation = simulation
        self._what = what
        self._views = views

    def __getitem__(self, name: str) -> View:
        if name not in self._views:
            raise self._simulation.unknown(self._what, name, self._views)
        return self._views[name]

    def get(self, name: str, default: Any = None) -> Any:
        return self._views.get(name, default)

    def __contains__(self, name: object) -> bool:
        return name in self._views

    def __iter__(self) -> Iterator[str]:
        return iter(self._views)

    def __len__(self) -> int:
        return len(self._views)


class MechanicsView:
    """The mechanics of an axis: its true position, in its units."""

    def __init__(self, simulation: Simulation, fitted: BuiltAxis) -> None:
        self._simulation = simulation
        self._fitted = fitted

    @property
    def _now(self) -> int:
        self._simulation.sync(self._fitted.spec.drive[0])
        return self._simulation.now

    @property
    def unit(self) -> str:
        return self._fitted.scale.unit

    @property
    def position(self) -> float:
        """True position of the load."""
        return self._fitted.units(self._fitted.mechanism.grid_position(self._now))

    @property
    def rotor(self) -> float:
        """Position of the motor, without backlash."""
        return self._fitted.units(self._fitted.mechanism.at(self._now).rotor)

    @property
    def lost(self) -> int:
        """Lost pulses: commanded minus true position of the motor; negative after losses in the negative direction."""
        return self._fitted.mechanism.lost(self._now)

    @property
    def stalled(self) -> bool:
        """Whether the motor is stalled at this moment."""
        return self._fitted.mechanism.at(self._now).stalled


class LineView:
    """A line, for Python programs that send and receive on it."""

    def __init__(self, simulation: Simulation, name: str) -> None:
        self._simulation = simulation
        self.name = name

    def send(self, data: bytes, place: str = "python") -> None:
        """Put bytes on the line at the present moment."""
        line = self._simulation.lines[self.name]
        self._simulation.apply_input(Bytes(self.name, place, line.kinds[0], data))

    def received(self, place: str = "python") -> bytes:
        """Remove and return the bytes received for ``place``."""
        self._simulation.sync(self.name)
        line = self._simulation.lines[self.name]
        return b"".join(data for _, data in line.connect(place).take(self._simulation.now))
