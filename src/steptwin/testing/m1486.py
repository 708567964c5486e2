"""An M1486 in the hands of a test."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, TypeVar

import pytest

from steptwin.drivers import m1486 as host
from steptwin.drivers.address import parse_device
from steptwin.drivers.place import Channel, parse_place
from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486, OPEN_ADDRESS
from steptwin.m1486.lines import interface
from steptwin.m1486.variants import DEFAULT, variant
from steptwin.machine import Nanos, Port
from steptwin.served.m1486 import ChainOptions, M1486Line, chip_name, pin_change
from steptwin.served.serve_m1486 import program_image
from steptwin.testing.realtime import RealTime, WallTime
from steptwin.testing.rig import LineRig, check_time, check_word
from steptwin.testing.virtualtime import MemoryEndpoint, VirtualTime, joined_chip

T = TypeVar("T")

MARKER = "m1486"
BAUD = 4800
"""Of a serial port, where ``--device`` does not say another: the highest that pins can choose at 12 MHz."""


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Options:
    """What ``@pytest.mark.m1486`` takes. Files are looked for beside the test."""

    variant: str = DEFAULT.name
    """A, B, C, E1, E2, or A2x and so on."""
    address: int = OPEN_ADDRESS
    """0 to 15."""
    interface: str = "sd"
    """Of the driver: sd, dual or two."""
    program: str | Path | None = None
    """A program to switch on with."""
    time: Literal["real", "virtual"] = "real"
    """Virtual time passes only while the test lets it, and needs no clock; programs outside need real time."""
    speed: float = 1.0
    """In real time: seconds of the twin per second, 0.001 to 1000."""
    link: Literal["tcp", "pty"] = "tcp"
    """What ``address`` and ``channel`` are: characters over TCP, or a pseudo terminal."""
    faults: Sequence[str] = ()
    """Faults that are there from the beginning, as `M1486Rig.fault` takes them."""
    seed: int = 0
    """Of the faults' chance."""
    line_timing: bool = False
    """Characters take their time on the wire."""
    baud: int | None = None
    """With ``line_timing``, in bit/s. None: the highest that pins choose."""
    twin_only: bool = False
    """Skip the test before it begins where a device stands in the twin's place."""


class M1486Rig(LineRig[M1486Line]):
    """A running M1486: a twin of its own for each test, or the device that ``--device`` names.

    ``driver`` drives it, ``channel`` carries bare characters to it and back, ``address`` is for a program under test. A serial
    port and a pty are for one of them at a time. What is said to be *the twin's* skips the test on a device.
    """

    def __init__(self, options: M1486Options, device: str | None, directory: Path, base: Path) -> None:
        check_time(MARKER, options.time)
        check_word(MARKER, "link", options.link, ("tcp", "pty"))
        self.options = options
        self._channel: Channel | None = None
        self._opened: list[host.M1486] = []
        line, time = None, None
        if device is None:
            line = self._make(base)
            time = VirtualTime(line.kernel) if options.time == "virtual" else RealTime(line.kernel, options.speed, "the M1486")
        super().__init__(
            MARKER,
            time or WallTime(),
            device,
            directory,
            line=line,
            machine=chip_name(options.address),
            twin_only=options.twin_only,
        )

    def _make(self, base: Path) -> M1486Line:
        options = self.options
        chain = ChainOptions(
            variant=variant(options.variant),
            addresses=[options.address],
            interface=interface(options.interface),
            baud=options.baud,
            is_timed=options.line_timing,
            is_written_down=True,
        )
        image = None if options.program is None else program_image(base / options.program, chain)
        line = M1486Line(chain, image=image)
        line.faults.start(options.faults, options.seed)
        return line

    # ------------------------------------------------------------------ talking to it

    @cached_property
    def address(self) -> str:
        """Where a program finds it: ``tcp://127.0.0.1:PORT`` or a path, as ``link`` says. Raises `Misuse` in virtual time."""
        if self._line is None:
            return str(self._device).partition(",")[0]
        time = self._time
        if not isinstance(time, RealTime):
            raise Misuse("a twin in virtual time has no address, for programs outside need a clock: use time='real'")
        if self.options.link == "pty":
            return str(time.open_pty(self._directory / MARKER, self._port))
        return f"tcp://{time.open_tcp(self._port)}"

    def _port(self) -> Port:
        line = self._line or self.twin_only("a port")
        return line.client_port()

    @property
    def channel(self) -> Channel:
        """Characters to it and back; closed after the test."""
        if self._channel is None:
            if isinstance(self._time, VirtualTime):
                self._channel = MemoryEndpoint(self._time, self._port, "the M1486").open()
            else:
                self._channel = parse_place(self.address, self._baud()).endpoint.open()
        return self._channel

    @cached_property
    def driver(self) -> host.M1486:
        """A driver that is connected to it; it is closed after the test."""
        driver = self._driver()
        driver.open()
        self._opened.append(driver)
        return driver

    def _driver(self) -> host.M1486:
        options, time = self.options, self._time
        if self._device is not None:
            given = parse_device(self._device)
            return host.M1486(given.place, given.chip, baud=given.baud, variant=given.variant)
        if isinstance(time, VirtualTime):
            return joined_chip(MemoryEndpoint(time, self._port, "the M1486"), time, options.address)
        return host.M1486(self.address, options.address)

    def _baud(self) -> int:
        options = str(self._device).split(",")[1:]
        return next((int(text.removeprefix("baud=")) for text in options if text.startswith("baud=")), BAUD)

    def send(self, *lines: str) -> None:
        """Type commands, each with its CR."""
        self.channel.write("".join(f"{line}\r" for line in lines).encode("latin-1"))

    def receive(self, count: int = 1, within_s: float = 1.0) -> bytes:
        """The next characters. The test fails where they do not come within ``within_s`` seconds of the twin."""
        __tracebackhide__ = True
        received = bytearray()

        def is_there() -> bool:
            received.extend(self.channel.read(0.0))
            return len(received) >= count

        if not self._time.until(is_there, within_s):
            pytest.fail(f"after {within_s:g} s only {len(received)} of {count} characters: {received.hex(' ') or 'none'}")
        return bytes(received)

    # ------------------------------------------------------------------ inputs, faults, power

    def call(self, act: Callable[[M1486, Nanos], T]) -> T:
        """Do anything with the twin at the present moment; it is not to be kept. The twin's."""
        __tracebackhide__ = True
        return self._on("the machine behind call()", lambda line, now: act(line.chips[self.options.address], now))

    def set_pin(self, pin: str, value: float) -> None:
        """Pull B1–B21, JOG, LIMIT, SD or RST low (0) or let it go high (1). Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        change = pin_change(pin, value)
        self._set_pin(change.pin, float(change.level))

    @property
    def position(self) -> int:
        """Where the pulses given so far have led, in minimum microsteps. The twin's."""
        __tracebackhide__ = True
        return self.call(lambda chip, now: chip.drive.true_u(now))

    @property
    def is_moving(self) -> bool:
        """Whether the motor runs. The twin's."""
        __tracebackhide__ = True
        return self.call(lambda chip, _: chip.drive.is_busy)

    def power_cycle(self) -> None:
        """Switch it off and on again. Connections stay. The twin's."""
        __tracebackhide__ = True
        self.call(lambda chip, now: chip.power_cycle(now))

    # ------------------------------------------------------------------ end

    def close(self) -> None:
        """After the test. A device is told to stop (Kill), motion and program, whichever chip of the line it is."""
        try:
            if self._line is None and not self._is_twin_only:
                self.send("XG", "K")
        finally:
            for driver in self._opened:
                driver.close()
            if self._channel is not None:
                self._channel.close()
            super().close()
