"""What a person sees of a running world: its controllers, their axes, and the mechanics. Everything is as of the present moment.

Positions in the units of the axis, times in seconds, torques in N·m.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488
from steptwin.mic488.program import ProgramState
from steptwin.mic488.status import Status
from steptwin.world import script as do
from steptwin.world.actions import Bytes
from steptwin.world.build import Fitted

if TYPE_CHECKING:
    from steptwin.world.plant import Plant

View = TypeVar("View")


class Views(Mapping[str, View], Generic[View]):
    """Views by name. A name that is not there raises `Misuse` with those that are."""

    def __init__(self, plant: Plant, what: str, views: Mapping[str, View]) -> None:
        self._plant = plant
        self._what = what
        self._views = views

    def __getitem__(self, name: str) -> View:
        if name not in self._views:
            raise self._plant.unknown(self._what, name, self._views)
        return self._views[name]

    def get(self, name: str, default: Any = None) -> Any:
        return self._views.get(name, default)

    def __contains__(self, name: object) -> bool:
        return name in self._views

    def __iter__(self) -> Iterator[str]:
        return iter(self._views)

    def __len__(self) -> int:
        return len(self._views)


class MachineView:
    """What all controllers have."""

    def __init__(self, plant: Plant, name: str) -> None:
        self._plant = plant
        self.name = name

    def _touch(self) -> None:
        self._plant.touch(self.name)

    @property
    def pins(self) -> Mapping[str, float]:
        """The level of every pin: 0, 1, volts."""
        self._touch()
        return self._plant.machines[self.name].pins()

    def set_pin(self, pin: str, value: float) -> None:
        """Set an input from outside: 0, 1, volts. Raises `Misuse`."""
        self._plant.outside(do.Set(((self.name, pin.upper(), float(value)),)))

    def power_cycle(self) -> None:
        """Switch it off and on again."""
        self._plant.outside(do.PowerCycle(self.name))


class Mic488View(MachineView):
    """A MIC488. ``device`` is the controller itself: what is changed there directly is not part of a session."""

    def __init__(self, plant: Plant, name: str, device: Mic488) -> None:
        super().__init__(plant, name)
        self.device = device
        self.axis: Mapping[int, Mic488AxisView] = _Axes((axis.number, Mic488AxisView(self, axis)) for axis in device.axes)
        """Axes by number, from 1. A number that is not there raises `Misuse`."""

    @property
    def status(self) -> int:
        """M_STATUS."""
        self._touch()
        return int(self.device.status())

    @property
    def program(self) -> ProgramState:
        self._touch()
        return self.device.program.state

    def write(self, register: str, value: float) -> None:
        """Write a register by name as a master does, over the line if there is one. Raises `Misuse`."""
        self._plant.outside(do.Write(((self.name, register.upper(), float(value)),)))


class _Axes(dict[int, "Mic488AxisView"]):
    def __missing__(self, number: object) -> Mic488AxisView:
        raise Misuse(f"no axis {number!r}: axes are {', '.join(map(str, self))}")


class Mic488AxisView:
    """An axis as its controller sees it, in configured units."""

    def __init__(self, controller: Mic488View, axis: Axis) -> None:
        self._controller = controller
        self._axis = axis

    @property
    def _now(self) -> int:
        self._controller._touch()
        return self._controller._plant.now

    @property
    def number(self) -> int:
        return self._axis.number

    @property
    def unit(self) -> str:
        return self._axis.config.unit_name

    @property
    def position(self) -> float:
        """POS_ACT in units."""
        return self._axis.coordinate_p(self._now) / self._axis.gear

    @property
    def velocity(self) -> float:
        """VEL_ACT in units/s."""
        return self._axis.profile.velocity(self._now) / self._axis.gear

    @property
    def status(self) -> Status:
        self._controller._touch()
        return self._axis.status

    @property
    def enabled(self) -> bool:
        self._controller._touch()
        return self._axis.enabled

    @property
    def moving(self) -> bool:
        return self._axis.profile.moving(self._now)

    @property
    def encoder(self) -> int:
        """ENC_IMP in counts."""
        return self._axis.encoder_counts(self._now)

    def enable(self) -> None:
        """Switch the drive on."""
        self._controller.write(f"M{self.number}_EN", 1)

    def move_to(self, position: float) -> None:
        """Begin to move to ``position`` in units (POS_ABS)."""
        self._controller.write(f"M{self.number}_POS_ABS", position)

    def move_by(self, distance: float) -> None:
        """Begin to move by ``distance`` in units (POS_REL)."""
        self._controller.write(f"M{self.number}_POS_REL", distance)

    def home(self, velocity: float) -> None:
        """Begin to home at ``velocity`` in units/s; its sign chooses the switch."""
        self._controller.write(f"M{self.number}_HOME", velocity)

    def stop(self) -> None:
        """Stop without ramp."""
        self._controller.write(f"M{self.number}_STOP", 1)


class M1486View(MachineView):
    """An M1486. Positions in minimum microsteps."""

    def __init__(self, plant: Plant, name: str, chip: M1486) -> None:
        super().__init__(plant, name)
        self.chip = chip

    @property
    def position(self) -> int:
        """Where the pulses given so far have led, since power-on."""
        self._touch()
        return self.chip.drive.true_u(self._plant.now)

    @property
    def counter(self) -> int:
        """The position counter, 24 bits."""
        self._touch()
        return self.chip.drive.counter_u(self._plant.now)

    @property
    def moving(self) -> bool:
        self._touch()
        return self.chip.drive.is_busy


class AxisView:
    """The mechanics of an axis: where it really is, in its units."""

    def __init__(self, plant: Plant, fitted: Fitted) -> None:
        self._plant = plant
        self._fitted = fitted

    @property
    def _now(self) -> int:
        self._plant.touch(self._fitted.spec.drive[0])
        return self._plant.now

    @property
    def unit(self) -> str:
        return self._fitted.scale.unit

    @property
    def position(self) -> float:
        """True position of the load."""
        return self._fitted.units(self._fitted.mechanism.place(self._now))

    @property
    def rotor(self) -> float:
        """Where the motor is, play not counted."""
        return self._fitted.units(self._fitted.mechanism.at(self._now).rotor)

    @property
    def lost(self) -> int:
        """Pulses by which the motor is behind the pulses given; negative where it is above, after losses on the way down."""
        return self._fitted.mechanism.lost(self._now)

    @property
    def stalled(self) -> bool:
        """Whether the motor has lost the field at this moment."""
        return self._fitted.mechanism.at(self._now).stalled


class LineView:
    """A line, for programs that speak on it from Python."""

    def __init__(self, plant: Plant, name: str) -> None:
        self._plant = plant
        self.name = name

    def send(self, data: bytes, place: str = "python") -> None:
        """Put bytes on the line at the present moment."""
        line = self._plant.lines[self.name]
        self._plant.outside(Bytes(self.name, place, line.kinds[0], data))

    def received(self, place: str = "python") -> bytes:
        """What has come for ``place`` and was not fetched yet."""
        self._plant.touch(self.name)
        line = self._plant.lines[self.name]
        return b"".join(data for _, data in line.connect(place).take(self._plant.now))
