"""A MIC488 in the hands of a test."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

import pytest

from steptwin.diagnostics import render
from steptwin.drivers import Mic488, load_config
from steptwin.drivers.address import parse_device
from steptwin.errors import Misuse
from steptwin.files.programbanks import Banks, ProgramErrors, read_banks
from steptwin.machine import Nanos, Port
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488 as Twin
from steptwin.mic488.device import check_pin
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE, register_map
from steptwin.mic488.status import Status
from steptwin.served.demo import demo_config
from steptwin.served.mic488 import LineOptions, Mic488Line
from steptwin.testing.devices import driver_of
from steptwin.testing.realtime import RealTime, WallTime
from steptwin.testing.rig import LineRig, check_time, check_word
from steptwin.testing.virtualtime import MemoryEndpoint, VirtualTime, joined_driver
from steptwin.wbc.dialect import dialect_for
from steptwin.world.faults import Line

T = TypeVar("T")

MARKER = "mic488"
LINKS: Mapping[str, Line] = {"tcp": Line.TCP, "rtu": Line.RTU, "pty": Line.RTU}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mic488Options:
    """What ``@pytest.mark.mic488`` takes. Files are looked for beside the test."""

    firmware: str | None = None
    """Of the twin (default 1.70); a device with another one skips the test."""
    config: str | Path | ControllerConfig | None = None
    """The vendor tool's ``.cfg``. Without it the twin is the machine of ``serve mic488 --demo``: millimetres, 100 pulses per mm,
    switches KL at −10 mm on IN1–IN4 and KR at 250 mm on IN5–IN8. With it inputs are the test's alone."""
    program: str | Path | None = None
    """A WBC program for bank 0."""
    positions: str | Path | None = None
    """A position table for bank 0."""
    unit: int = 1
    """Slave address, 1 to 247."""
    time: Literal["real", "virtual"] = "real"
    """Virtual time passes only while the test lets it, and needs no clock; programs outside need real time."""
    speed: float = 1.0
    """In real time: seconds of the twin per second, 0.001 to 1000."""
    link: Literal["tcp", "rtu", "pty"] = "tcp"
    """What ``address`` and ``driver`` speak: Modbus TCP, RTU over TCP, RTU on a pseudo terminal."""
    faults: Sequence[str] = ()
    """Faults that are there from the beginning, as `Mic488Rig.fault` takes them."""
    seed: int = 0
    """Of the faults' chance."""
    lenient: bool = False
    """Holes in the register map read as 0 (MIC-3)."""
    line_timing: bool = False
    """RTU answers take their time on the wire."""
    baud: int = 38400
    """With ``line_timing``, in bit/s."""
    twin_only: bool = False
    """Skip the test before it begins where a device stands in the twin's place."""


class TwinAxis(NamedTuple):
    """An axis of a twin at one moment, as it really is; no request is needed to see it."""

    position: float
    """Counted, in configured units."""
    velocity: float
    """In units/s."""
    unit: str
    position_p: int
    """Counted, in pulses."""
    status: Status
    enabled: bool
    encoder: int
    """In counts."""


class Mic488Rig(LineRig[Mic488Line]):
    """A running MIC488: a twin of its own for each test, or the device that ``--device`` names.

    ``driver`` talks to it, ``address`` is for a program under test. A serial port and a pty are for one of them at a time. What
    is said to be *the twin's* skips the test on a device.
    """

    def __init__(self, options: Mic488Options, device: str | None, directory: Path, base: Path) -> None:
        check_time(MARKER, options.time)
        check_word(MARKER, "link", options.link, tuple(LINKS))
        if not 1 <= options.unit <= 247:
            raise Misuse(f"@pytest.mark.{MARKER}: unit = {options.unit}: permitted are 1 to 247")
        self.options = options
        self._opened: list[Mic488] = []
        self._config = _config(options, base)
        line, time = None, None
        if device is None:
            line = self._make(base)
            time = VirtualTime(line.kernel) if options.time == "virtual" else RealTime(line.kernel, options.speed, "the MIC488")
        super().__init__(
            "mic488",
            time or WallTime(),
            device,
            directory,
            line=line,
            machine=str(options.unit),
            twin_only=options.twin_only,
        )

    def _make(self, base: Path) -> Mic488Line:
        options = self.options
        config = self._config or demo_config()
        line = Mic488Line(
            config,
            [options.unit],
            options.firmware or DEFAULT_FIRMWARE,
            _banks(options, config, base),
            lenient=options.lenient,
            demo=self._config is None,
            options=LineOptions(baud=options.baud, timing=options.line_timing, frames=True),
        )
        line.faults.lines = {LINKS[options.link]}
        line.faults.start(options.faults, options.seed)
        return line

    # ------------------------------------------------------------------ talking to it

    @cached_property
    def address(self) -> str:
        """Where a program finds it: ``tcp://127.0.0.1:PORT``, ``rtu-tcp://127.0.0.1:PORT`` or a path, as ``link`` says.

        Raises `Misuse` in virtual time: programs outside need a clock.
        """
        if self._line is None:
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
        line = self._line or self.twin_only("a port")
        return line.tcp_port() if self.options.link == "tcp" else line.rtu_client_port()

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
        config = self._config or demo_config()
        if not isinstance(time, VirtualTime):
            return Mic488(self.address, options.unit, firmware=firmware, config=config)
        endpoint = MemoryEndpoint(time, self._port, "the MIC488")
        return joined_driver(endpoint, time, options.unit, framed=options.link == "tcp", firmware=firmware, config=config)

    # ------------------------------------------------------------------ inputs, faults, power

    def call(self, act: Callable[[Twin, Nanos], T]) -> T:
        """Do anything with the twin at the present moment; it is not to be kept. The twin's."""
        __tracebackhide__ = True
        return self._on("the machine behind call()", lambda line, now: act(line.devices[self.options.unit], now))

    def set_pin(self, pin: str, value: float) -> None:
        """Set IN1–IN20 (0 or 1), AIN1 or AIN2 (0 to 10 V) from outside. Raises `Misuse`. The twin's.

        The controller notices after the filter of the input, 10 ms unless the configuration says otherwise.
        """
        __tracebackhide__ = True
        check_pin(pin, float(value))
        self._set_pin(pin.upper(), float(value))

    def axis(self, number: int) -> TwinAxis:
        """Axis 1 to 4 as it really is at this moment. The twin's."""
        __tracebackhide__ = True
        if not 1 <= number <= AXES:
            raise Misuse(f"no axis {number}: axes are 1 to {AXES}")

        def act(line: Mic488Line, now: Nanos) -> TwinAxis:
            axis = line.devices[self.options.unit].axes[number - 1]
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

        return self._on(f"axis({number})", act)

    def turn_encoder(self, axis: int, counts: int) -> None:
        """Turn the shaft of axis 1 to 4 by hand, by encoder counts. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        self.call(lambda device, now: device.turn_encoder(axis, counts, now))

    def power_cycle(self) -> None:
        """Switch it off and on again. Connections stay. The twin's."""
        __tracebackhide__ = True
        self.call(lambda device, now: device.power_cycle(now))

    # ------------------------------------------------------------------ beginning and end

    def begin(self) -> None:
        super().begin()
        wanted = self.options.firmware
        if self._line is None and wanted is not None and _addresses(self.driver.firmware) != _addresses(wanted):
            pytest.skip(f"this test is for firmware {wanted}, {self._device} has {self.driver.firmware}")

    def close(self) -> None:
        """After the test. The axes of a device and its program are stopped."""
        try:
            if self._line is None and not self._is_twin_only:
                driver = self.driver
                if driver.status().program:
                    driver.program.stop()
                driver.stop_all()
        finally:
            for driver in self._opened:
                driver.close()
            super().close()


def _addresses(firmware: str) -> int:
    """Where the registers of a firmware begin: all that a driver can find out of it."""
    return register_map(firmware).of("DATA_TYPE").address


def _config(options: Mic488Options, base: Path) -> ControllerConfig | None:
    config = options.config
    if config is None or isinstance(config, ControllerConfig):
        return config
    return load_config(base / config, options.firmware or DEFAULT_FIRMWARE)


def _banks(options: Mic488Options, config: ControllerConfig, base: Path) -> Banks:
    firmware = options.firmware or DEFAULT_FIRMWARE
    programs = {} if options.program is None else {0: base / options.program}
    positions = {} if options.positions is None else {0: base / options.positions}
    try:
        return read_banks(programs, positions, config, dialect_for(firmware))
    except ProgramErrors as errors:
        texts = [render(source, found) for source, found in errors.findings if found]
        raise Misuse("\n".join([str(errors), *texts])) from None
