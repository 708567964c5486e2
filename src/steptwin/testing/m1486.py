"""The rig of an M1486 for tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, TypeVar

import pytest

from steptwin.controller import Nanos, Port
from steptwin.drivers import m1486 as host
from steptwin.drivers.address import parse_device
from steptwin.drivers.lineaddress import parse_line_address
from steptwin.drivers.tcp import Channel
from steptwin.errors import Misuse
from steptwin.files.loader import set_faults
from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.live.world import LiveWorld
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.pins import OPEN_ADDRESS
from steptwin.m1486.variants import DEFAULT
from steptwin.simulation.describe.generated import Whole
from steptwin.simulation.describe.generated_m1486 import chip_name, m1486_world
from steptwin.testing.realtime import RealTime, WallTime
from steptwin.testing.rig import LineRig, Observe, check_time, check_word
from steptwin.testing.virtualtime import MemoryEndpoint, VirtualTime, connected_chip

T = TypeVar("T")

MARKER = "m1486"
BAUD = 4800
"""Rate of a serial port, where ``--device`` gives no other: the highest that pins can choose at 12 MHz."""


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Marker:
    """The options of ``@pytest.mark.m1486``. Paths are relative to the test."""

    variant: str = DEFAULT.name
    """A, B, C, E1, E2, or A2x and so on."""
    address: int = OPEN_ADDRESS
    """0 to 15."""
    interface: str = "sd"
    """Interface of the driver: sd, dual or two."""
    program: str | Path | None = None
    """A program to switch on with."""
    time: Literal["real", "virtual"] = "real"
    """Virtual time advances only on request of the test; external programs need real time."""
    speed: float = 1.0
    """In real time: seconds of the twin per second, 0.001 to 1000."""
    link: Literal["tcp", "pty"] = "tcp"
    """Link of ``address`` and ``channel``: characters over TCP, or a pseudo terminal."""
    faults: Sequence[str] = ()
    """Faults that are set from the beginning, as for `M1486Rig.fault`."""
    seed: int = 0
    """Random seed of faults."""
    line_timing: bool = False
    """Characters take their time on the wire."""
    baud: int | None = None
    """With ``line_timing``, in bit/s. None: the highest that pins choose."""
    twin_only: bool = False
    """Skip the test before it begins where a device stands in the twin's place."""


class M1486Rig(LineRig):
    """A running M1486: a twin of its own for each test, or the device that ``--device`` names.

    ``driver`` drives it, ``channel`` carries bare characters to it and back, ``address`` is for a program under test. A serial
    port and a pty are for one of them at a time. What is marked as *the twin's* skips the test on a device.
    """

    def __init__(self, options: M1486Marker, device: str | None, directory: Path, base: Path, observe: Observe) -> None:
        check_time(MARKER, options.time)
        check_word(MARKER, "link", options.link, ("tcp", "pty"))
        self.options = options
        self._channel: Channel | None = None
        self._opened: list[host.M1486] = []
        self._name_there = chip_name(options.address)
        live, time = None, None
        if device is None:
            world = self._make(base)
            observe(world, base)
            live = LiveWorld(world)
            time = VirtualTime(live) if options.time == "virtual" else RealTime(live, options.speed, "the M1486")
        super().__init__(
            MARKER,
            time or WallTime(),
            device,
            directory,
            live=live,
            controller=self._name_there,
            twin_only=options.twin_only,
        )

    def _make(self, base: Path) -> World:
        options = self.options
        program = None if options.program is None else str(base / options.program)
        files = {} if program is None else {program: read_bytes(Path(program))}
        line = {"tcp": "127.0.0.1:0", "baud": options.baud, "timing": "real" if options.line_timing else None}
        values = {"variant": options.variant, "interface": options.interface, "program": program}
        text = m1486_world(Whole(name=MARKER, line=line, seed=options.seed), [options.address], values)
        world = World.from_toml(text, files, name=f"@pytest.mark.{MARKER}", keep_inputs=False)
        set_faults(world, options.faults)
        return world

    # ------------------------------------------------------------------ talking to it

    @cached_property
    def address(self) -> str:
        """Where a program finds it: ``tcp://127.0.0.1:PORT`` or a path, by ``link``. Raises `Misuse` in virtual time."""
        if self._live is None:
            return str(self._device).partition(",")[0]
        time = self._time
        if not isinstance(time, RealTime):
            raise Misuse("a twin in virtual time has no address, for programs outside need a clock: use time='real'")
        if self.options.link == "pty":
            return str(time.open_pty(self._directory / MARKER, self._port))
        return f"tcp://{time.open_tcp(self._port)}"

    def _port(self) -> Port:
        return self._place("tcp", "raw")

    @property
    def channel(self) -> Channel:
        """Characters to it and back; closed after the test."""
        if self._channel is None:
            if isinstance(self._time, VirtualTime):
                self._channel = MemoryEndpoint(self._time, self._port, "the M1486").open()
            else:
                self._channel = parse_line_address(self.address, self._baud()).endpoint.open()
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
            return host.M1486(given.place, given.number, baud=given.baud, variant=given.variant)
        if isinstance(time, VirtualTime):
            return connected_chip(MemoryEndpoint(time, self._port, "the M1486"), time, options.address)
        return host.M1486(self.address, options.address)

    def _baud(self) -> int:
        options = str(self._device).split(",")[1:]
        return next((int(text.removeprefix("baud=")) for text in options if text.startswith("baud=")), BAUD)

    def send(self, *lines: str) -> None:
        """Type commands, each with its CR."""
        self.channel.write("".join(f"{line}\r" for line in lines).encode("latin-1"))

    def receive(self, count: int = 1, within_s: float = 1.0) -> bytes:
        """The next characters. The test fails if they do not arrive within ``within_s`` seconds of the twin."""
        __tracebackhide__ = True
        received = bytearray()

        def is_there() -> bool:
            received.extend(self.channel.read(0.0))
            return len(received) >= count

        if not self._time.until(is_there, within_s):
            pytest.fail(f"after {within_s:g} s only {len(received)} of {count} characters: {received.hex(' ') or 'none'}")
        return bytes(received)

    # ------------------------------------------------------------------ inputs, faults, power

    def call(self, act: Callable[[M1486Chip, Nanos], T]) -> T:
        """Do anything with the twin at the present moment; it is not to be kept. The twin's."""
        __tracebackhide__ = True
        return self._on("the controller behind call()", lambda world: act(world.m1486[self._name_there].chip, world.now))

    def set_pin(self, pin: str, value: float) -> None:
        """Pull B1–B21, JOG, LIMIT, SD or RST low (0) or let it go high (1). Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        self._set_pin(pin, float(value))

    @property
    def position(self) -> int:
        """The count of all pulses, in minimum microsteps. The twin's."""
        __tracebackhide__ = True
        return self.call(lambda chip, now: chip.drive.true_u(now))

    @property
    def is_moving(self) -> bool:
        """Whether the motor runs. The twin's."""
        __tracebackhide__ = True
        return self.call(lambda chip, _: chip.drive.is_busy)

    # ------------------------------------------------------------------ end

    def close(self) -> None:
        """After the test. A device is stopped (Kill), motion and program, whichever chip of the line it is."""
        try:
            if self._live is None and not self._is_twin_only:
                self.send("XG", "K")
        finally:
            for driver in self._opened:
                driver.close()
            if self._channel is not None:
                self._channel.close()
            super().close()
