"""A MIC488 of a running world for Python programs."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.status import AxisStatus, ProgramState
from steptwin.simulation.kinds.controllerview import ControllerView
from steptwin.simulation.kinds.kind import RunningWorld
from steptwin.simulation.script import steps as do


class Mic488View(ControllerView):
    """A MIC488. ``device`` is the controller itself: what is changed there directly is not part of a recording."""

    def __init__(self, world: RunningWorld, name: str, device: Mic488Device) -> None:
        super().__init__(world, name)
        self.device = device
        self.axis: Mapping[int, Mic488AxisView] = _Axes((axis.number, Mic488AxisView(self, axis)) for axis in device.axes)
        """Axes by number, from 1. A number that is not there raises `Misuse`."""

    @property
    def status(self) -> int:
        """M_STATUS."""
        self._sync()
        return int(self.device.status())

    @property
    def program(self) -> ProgramState:
        self._sync()
        return self.device.program.state

    def write(self, register: str, value: float) -> None:
        """Write a register by name as a master does, over the line if there is one. Raises `Misuse`."""
        self._world.apply_input(do.Write(((self.name, register.upper(), float(value)),)))


NO_SUCH_AXIS = Message("simulation.mic488.no-such-axis", "no axis {number!r}: axes are {names}")


class _Axes(dict[int, "Mic488AxisView"]):
    def __missing__(self, number: object) -> Mic488AxisView:
        raise Misuse(NO_SUCH_AXIS(number=number, names=list(self)))


class Mic488AxisView:
    """An axis as its controller sees it, in configured units."""

    def __init__(self, controller: Mic488View, axis: Axis) -> None:
        self._controller = controller
        self._axis = axis

    @property
    def _now(self) -> int:
        self._controller._sync()
        return self._controller._world.now

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
    def status(self) -> AxisStatus:
        self._controller._sync()
        return self._axis.status

    @property
    def enabled(self) -> bool:
        self._controller._sync()
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
