"""The rig of a MIC488 for tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

import pytest

from steptwin.controller import Nanos, Port
from steptwin.drivers import Mic488, load_config
from steptwin.drivers.address import parse_device
from steptwin.errors import Misuse
from steptwin.files.loader import set_faults
from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.live.world import LiveWorld
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.configtext import config_text
from steptwin.mic488.core import check_pin
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE, register_map
from steptwin.mic488.registers import firmware as known_firmware
from steptwin.mic488.status import AxisStatus
from steptwin.simulation.describe.generated import Whole
from steptwin.simulation.describe.generated_mic488 import mic488_world
from steptwin.simulation.script import steps as do
from steptwin.testing.devices import driver_of
from steptwin.testing.realtime import RealTime, WallTime
from steptwin.testing.rig import LineRig, Observe, check_time, check_word
from steptwin.testing.virtualtime import MemoryEndpoint, VirtualTime, connected_driver

T = TypeVar("T")

MARKER = "mic488"
NAME = "mic488"
"""Name of the controller in its world."""
CONFIG = "machine.cfg"
"""Name of its configuration there."""
LINKS: Mapping[str, tuple[str, str]] = {"tcp": ("tcp", "tcp"), "rtu": ("rtu_tcp", "rtu"), "pty": ("pty", "rtu")}
"""The key of the line and the kind of place of each link."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mic488Marker:
    """The options of ``@pytest.mark.mic488``. Paths are relative to the test."""

    firmware: str | None = None
    """Firmware of the twin (default 1.70); a device with another one skips the test."""
    config: str | Path | ControllerConfig | None = None
    """The vendor tool's ``.cfg``. Without it the twin is the controller of ``serve mic488 --demo``: millimetres, 100 pulses per
    mm, switches KL at −10 mm on IN1–IN4 and KR at 250 mm on IN5–IN8. With it inputs are the test's alone."""
    program: str | Path | None = None
    """A WBC program for bank 0."""
    positions: str | Path | None = None
    """A position table for bank 0."""
    unit: int = 1
    """Slave address, 1 to 247."""
    time: Literal["real", "virtual"] = "real"
    """Virtual time advances only on request of the test; external programs need real time."""
    speed: float = 1.0
    """In real time: seconds of the twin per second, 0.001 to 1000."""
    link: Literal["tcp", "rtu", "pty"] = "tcp"
    """Protocol of ``address`` and ``driver``: Modbus TCP, RTU over TCP, RTU on a pseudo terminal."""
    faults: Sequence[str] = ()
    """Faults that are set from the beginning, as for `Mic488Rig.fault`."""
    seed: int = 0
    """Random seed of faults."""
    lenient: bool = False
    """Holes in the register map read as 0 (MIC-3)."""
    line_timing: bool = False
    """RTU answers take their time on the wire."""
    baud: int = 38400
    """With ``line_timing``, in bit/s."""
    twin_only: bool = False
    """Skip the test before it begins where a device stands in the twin's place."""


class TwinAxis(NamedTuple):
    """The true state of an axis of a twin at one moment, read without a request."""

    position: float
    """Counted, in configured units."""
    velocity: float
    """In units/s."""
    unit: str
    position_p: int
    """Counted, in pulses."""
    status: AxisStatus
    enabled: bool
    encoder: int
    """In counts."""


class Mic488Rig(LineRig):
    """A running MIC488: a twin of its own for each test, or the device that ``--device`` names.

    ``driver`` talks to it, ``address`` is for a program under test. A serial port and a pty are for one of them at a time. What
    is marked as *the twin's* skips the test on a device.
    """

    def __init__(self, options: Mic488Marker, device: str | None, directory: Path, base: Path, observe: Observe) -> None:
        check_time(MARKER, options.time)
        check_word(MARKER, "link", options.link, tuple(LINKS))
        if not 1 <= options.unit <= 247:
            raise Misuse(f"@pytest.mark.{MARKER}: unit = {options.unit}: permitted are 1 to 247")
        self.options = options
        self._opened: list[Mic488] = []
        self._config = _config(options, base)
        live, time = None, None
        if device is None:
            world = self._make(base)
            observe(world, base)
            live = LiveWorld(world)
            time = VirtualTime(live) if options.time == "virtual" else RealTime(live, options.speed, "the MIC488")
        super().__init__(
            "mic488",
            time or WallTime(),
            device,
            directory,
            live=live,
            controller=NAME,
            twin_only=options.twin_only,
        )

    def _make(self, base: Path) -> World:
        options = self.options
        firmware = options.firmware or DEFAULT_FIRMWARE
        files: dict[str, bytes] = {}
        if self._config is not None:
            files[CONFIG] = config_text(self._config, known_firmware(firmware)).encode()
        for file in (options.program, options.positions):
            if file is not None:
                files[str(base / file)] = read_bytes(base / file)
        key, _ = LINKS[options.link]
        # The faults that are possible on a line depend on its external links.
        line = {key: "127.0.0.1:0", "baud": options.baud, "timing": "real" if options.line_timing else None}
        values = {
            "firmware": firmware,
            "config": CONFIG if files and self._config is not None else None,
            "program": None if options.program is None else str(base / options.program),
            "positions": None if options.positions is None else {0: str(base / options.positions)},
            "lenient": options.lenient or None,
        }
        whole = Whole(name=MARKER, line=line, seed=options.seed)
        text = mic488_world(whole, [options.unit], values, demo=self._config is None)
        world = World.from_toml(text, files, name=f"@pytest.mark.{MARKER}", keep_inputs=False)
        set_faults(world, options.faults)
        return world

    # ------------------------------------------------------------------ talking to it

    @cached_property
    def address(self) -> str:
        """Where a program finds it: ``tcp://127.0.0.1:PORT``, ``rtu-tcp://127.0.0.1:PORT`` or a path, according to ``link``.

        Raises `Misuse` in virtual time: programs outside need a clock.
        """
        if self._live is None:
            return parse_device(str(self._device)).place
        time = self._time
        if not isinstance(time, RealTime):
            raise Misuse("a twin in virtual time has no address, for programs outside need a clock: use time='real'")
        if self.options.link == "pty":
            return str(time.open_pty(self._directory / MARKER, self._port))
        scheme = {"tcp": "tcp", "rtu": "rtu-tcp"}[self.options.link]
        return f"{scheme}://{time.open_tcp(self._port)}"

    @property
    def device_address(self) -> str:
        """The same with its unit, as ``steptwin … --device`` takes it."""
        return self._device or f"{self.address},unit={self.options.unit}"

    def _port(self) -> Port:
        _, kind = LINKS[self.options.link]
        return self._place(kind, kind)

    @cached_property
    def driver(self) -> Mic488:
        """A driver that is connected to it; it is closed after the test."""
        driver = self._driver()
        driver.open()
        self._opened.append(driver)
        return driver

    def _driver(self) -> Mic488:
        options, time = self.options, self._time
        if self._device is not None:
            return driver_of(self._device, self._config)
        firmware = options.firmware or DEFAULT_FIRMWARE
        config = self.call(lambda device, _: device.config)
        if not isinstance(time, VirtualTime):
            return Mic488(self.address, options.unit, firmware=firmware, config=config)
        endpoint = MemoryEndpoint(time, self._port, "the MIC488")
        return connected_driver(endpoint, time, options.unit, framed=options.link == "tcp", firmware=firmware, config=config)

    # ------------------------------------------------------------------ inputs, faults, power

    def call(self, act: Callable[[Mic488Device, Nanos], T]) -> T:
        """Do anything with the twin at the present moment; it is not to be kept. The twin's."""
        __tracebackhide__ = True
        return self._on("the controller behind call()", lambda world: act(world.mic488[NAME].device, world.now))

    def set_pin(self, pin: str, value: float) -> None:
        """Set IN1–IN20 (0 or 1), AIN1 or AIN2 (0 to 10 V) from outside. Raises `Misuse`. The twin's.

        The controller notices after the filter of the input, 10 ms unless configured otherwise.
        """
        __tracebackhide__ = True
        check_pin(pin, float(value))
        self._set_pin(pin.upper(), float(value))

    def axis(self, number: int) -> TwinAxis:
        """The true state of axis 1 to 4 at this moment. The twin's."""
        __tracebackhide__ = True
        if not 1 <= number <= AXES:
            raise Misuse(f"no axis {number}: axes are 1 to {AXES}")

        def act(device: Mic488Device, now: Nanos) -> TwinAxis:
            axis = device.axes[number - 1]
            position_p = axis.coordinate_p(now)
            return TwinAxis(
                position=position_p / axis.gear,
                velocity=axis.profile.velocity(now) / axis.gear,
                unit=axis.config.unit_name,
                position_p=position_p,
                status=axis.status,
                enabled=axis.enabled,
                encoder=axis.encoder_counts(now),
            )

        return self._on(f"axis({number})", lambda world: act(world.mic488[NAME].device, world.now))

    def turn_encoder(self, axis: int, counts: int) -> None:
        """Turn the shaft of axis 1 to 4 by hand, by encoder counts. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        self._do("turn_encoder()", do.Turn(NAME, axis, counts))

    # ------------------------------------------------------------------ beginning and end

    def begin(self) -> None:
        super().begin()
        wanted = self.options.firmware
        if self._live is None and wanted is not None and _addresses(self.driver.firmware) != _addresses(wanted):
            pytest.skip(f"this test is for firmware {wanted}, {self._device} has {self.driver.firmware}")

    def close(self) -> None:
        """After the test. The axes of a device are stopped, and its program is paused: drives hold their load."""
        try:
            if self._live is None and not self._is_twin_only:
                self.driver.halt()
        finally:
            for driver in self._opened:
                driver.close()
            super().close()


def _addresses(firmware: str) -> int:
    """Where the registers of a firmware begin: all that a driver can find out of it."""
    return register_map(firmware).of("DATA_TYPE").address


def _config(options: Mic488Marker, base: Path) -> ControllerConfig | None:
    config = options.config
    if config is None or isinstance(config, ControllerConfig):
        return config
    return load_config(base / config, options.firmware or DEFAULT_FIRMWARE)
