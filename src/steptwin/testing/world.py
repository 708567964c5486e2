"""A world for a test: controllers with wiring and mechanics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

import steptwin.services  # noqa: F401  their tables are checked, too
from steptwin.controller import Nanos
from steptwin.drivers import Mic488
from steptwin.drivers.address import parse_device
from steptwin.drivers.lineaddress import parse_line_address
from steptwin.drivers.tcp import Channel
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.files.textfiles import read_text
from steptwin.files.world import World, read_beside
from steptwin.inputfiles import MOST_DESCRIPTION_BYTES
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.simulation.faults import read
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.records import describe, is_shown
from steptwin.subject.commands import Command, ListFaults
from steptwin.testing.devices import ANY, driver_of
from steptwin.testing.realtime import RealTime, WallTime
from steptwin.testing.rig import Observe, Rig, check_time
from steptwin.testing.virtualtime import MemoryEndpoint, VirtualTime, connected_driver

T = TypeVar("T")

MARKER = "steptwin_world"


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """Arguments of ``@pytest.mark.steptwin_world``."""

    file: str | Path | None = None
    """The world's TOML, beside the test."""
    _: KW_ONLY
    time: Literal["real", "virtual"] = "real"
    """Virtual time passes only while the test lets it, and needs no clock; programs outside need real time."""
    speed: float = 1.0
    """In real time: seconds of the world per second, 0.001 to 1000."""
    twin_only: bool = False
    """Skip the test before it begins where devices stand in the world's place."""


def controllers_in(file: Path) -> list[str]:
    """Names of the controllers in the world that a file describes. Raises `Misuse`."""
    text = read_text(file, MOST_DESCRIPTION_BYTES).source.text
    return _controllers(read_world(str(file), text, read=partial(read_beside, file.parent)))


def _controllers(spec: WorldSpec) -> list[str]:
    return [controller.name for controller in spec.controllers]


class WorldAxis(NamedTuple):
    """The mechanics of an axis at one moment."""

    position: float
    """Position of the load, in the axis' units."""
    unit: str
    lost: int
    """Pulses the motor has lost so far."""
    stalled: bool


class WorldRig(Rig):
    """A running world, new for each test. ``driver`` talks to one of its controllers, ``address`` is for a program under test.

    With ``--device NAME=ADDRESS`` drivers and addresses are those of real controllers, by the names of the world; members
    marked *the twin's* skip the test then.
    """

    def __init__(self, options: WorldOptions, devices: Mapping[str, str], base: Path, observe: Observe) -> None:
        check_time(MARKER, options.time)
        if options.file is None:
            raise Misuse(f'no world is given: @pytest.mark.{MARKER}("machine.toml")')
        world = World.load(base / options.file)
        self.options = options
        self._places = count(1)
        self._drivers: dict[str, Mic488] = {}
        self._addresses: dict[str, str] = {}
        self._channels: dict[str, Channel] = {}
        self._spec = world.spec
        self._mic488 = world.mic488
        names = _controllers(world.spec)
        self._given = {name: devices[name] for name in names if name in devices}
        if ANY in devices and not self._given:
            self._given = {names[0]: devices[ANY]} if len(names) == 1 else {ANY: devices[ANY]}
        if self._given:
            super().__init__(MARKER, WallTime(), ", ".join(self._given.values()), base)
            return
        observe(world, (base / options.file).parent)
        self._live = live = LiveWorld(world)
        super().__init__(
            MARKER,
            VirtualTime(live) if options.time == "virtual" else RealTime(live, options.speed, f"the world {world.spec.name}"),
            None,
            base,
        )
        world.trace.subscribers.append(self._happened)

    def _happened(self, record: TraceRecord) -> None:
        if is_shown(record):
            self._shown.append(describe(record))

    def begin(self) -> None:
        if self._given and (self.options.twin_only or ANY in self._given):
            self.twin_only("a world of several controllers (--device NAME=ADDRESS replaces one of them)")

    # ------------------------------------------------------------------ talking to it

    def address(self, line: str) -> str:
        """Where a program finds a line of the world: ``tcp://127.0.0.1:PORT``. Raises `Misuse`.

        Modbus TCP, or the characters of M1486 chips. In virtual time there is none: programs outside need a clock.
        """
        if line in self._addresses:
            return self._addresses[line]
        kind = self._kind(line)
        if self._given:
            there = [spec.name for spec in self._spec.controllers if spec.line == line and spec.name in self._given]
            if not there:
                self.twin_only(f"line {line!r}")
            return parse_device(self._given[there[0]]).place
        if not isinstance(self._time, RealTime):
            raise Misuse("a world in virtual time has no address, for programs outside need a clock: use time='real'")
        address = self._time.open_tcp(lambda: self._port(line, kind))
        self._addresses[line] = f"tcp://{address}"
        return self._addresses[line]

    def _kind(self, line: str) -> str:
        found = next((spec for spec in self._spec.lines if spec.name == line), None)
        if found is None:
            raise World.unknown("line", line, [spec.name for spec in self._spec.lines])
        return line_kinds()[found.kind].opened_by["tcp"].client_kind

    def _port(self, line: str, kind: str) -> ClientPort:
        return ClientPort(self._live, line, f"test-{next(self._places)}", kind)

    def driver(self, controller: str) -> Mic488:
        """A driver that is connected to a MIC488 of the world; it is closed after the test. Raises `Misuse`."""
        if controller not in self._drivers:
            driver = self._driver(controller)
            driver.open()
            self._drivers[controller] = driver
        return self._drivers[controller]

    def _driver(self, controller: str) -> Mic488:
        device = self._mic488[controller].device
        if self._given:
            if controller not in self._given:
                self.twin_only(f"controller {controller!r}")
            return driver_of(self._given[controller])
        on = self._live.world.objects.line_of.get(controller)
        if on is None:
            raise Misuse(f"{controller!r} is on no line: its table in {self.options.file} needs line = NAME")
        line, unit, firmware = on[0].name, on[1], device.firmware.name
        if not isinstance(self._time, VirtualTime):
            return Mic488(self.address(line), unit, firmware=firmware, config=device.config)
        endpoint = MemoryEndpoint(self._time, lambda: self._port(line, "tcp"), f"line {line!r}")
        return connected_driver(endpoint, self._time, unit, framed=True, firmware=firmware, config=device.config)

    def channel(self, line: str) -> Channel:
        """Characters to the M1486 chips of a line and back; closed after the test. Raises `Misuse`."""
        if line not in self._channels:
            kind = self._kind(line)
            if isinstance(self._time, VirtualTime):
                endpoint = MemoryEndpoint(self._time, lambda: self._port(line, kind), f"line {line!r}")
                self._channels[line] = endpoint.open()
            else:
                address = self.address(line)
                self._channels[line] = parse_line_address(address, 4800).endpoint.open()
        return self._channels[line]

    # ------------------------------------------------------------------ inputs, faults, power

    def call(self, act: Callable[[World], T]) -> T:
        """Do anything with the world at the present moment; it is not to be kept. The twin's."""
        __tracebackhide__ = True
        if self._given:
            self.twin_only("the world")

        def at(now: Nanos) -> T:
            try:
                return act(self._live.world)
            finally:
                self._live.is_dirty = True

        return self._at_present(at)

    def _in_world(self, act: Callable[[World], T]) -> T:
        __tracebackhide__ = True
        return self.call(act)

    def axis(self, name: str) -> WorldAxis:
        """Where the load of an axis really is. The twin's."""
        __tracebackhide__ = True

        def act(world: World) -> WorldAxis:
            axis = world.axis[name]
            return WorldAxis(axis.position, axis.unit, axis.lost, axis.stalled)

        return self.call(act)

    def do(self, wanted: Command) -> Any:
        """Do a command (`steptwin.subject.commands`), as over the control endpoint; its answer. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        return self.call(lambda _: self._live.subject.do(wanted).value)

    def value(self, signal: str) -> float:
        """A signal as conditions of the world name it: ``x.position``, ``table.IN1``, ``table.M1.status``. The twin's."""
        __tracebackhide__ = True
        return self.call(lambda world: world.read(signal))

    def set_pin(self, pin: str, value: float) -> None:
        """Set an input ``CONTROLLER.PIN`` from outside: 0, 1, volts. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        controller, dot, name = pin.rpartition(".")
        if not dot:
            raise Misuse(f"{pin!r}: expected CONTROLLER.PIN, such as {next(iter(self._spec.controllers), self._spec).name}.IN1")
        self.do(do.Set(((controller, name.upper(), float(value)),)))

    def press(self, button: str, for_s: float | None = None) -> None:
        """Press a button of the world, until `release` or for so many seconds. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        self.do(do.Press(button, None if for_s is None else duration(for_s)))

    def release(self, button: str) -> None:
        """The twin's."""
        __tracebackhide__ = True
        self.do(do.Release(button))

    def fault(self, *faults: str) -> None:
        """Set a fault, as `Mic488Rig.fault`. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        for fault in map(read, faults):
            self.do(do.SetFault(fault))

    def clear_faults(self, *names: str) -> None:
        """Clear faults by name; all without names. The twin's."""
        __tracebackhide__ = True
        for name in names or [fault["name"] for fault in self.do(ListFaults())]:
            self.do(do.ClearFault(name))

    # ------------------------------------------------------------------ end

    def close(self) -> None:
        """After the test. Devices that drivers were asked for are stopped."""
        try:
            if self._given:
                for driver in self._drivers.values():
                    driver.stop_all()
        finally:
            for driver in self._drivers.values():
                driver.close()
            for channel in self._channels.values():
                channel.close()
            super().close()
