"""The M1486 driver for threads: the methods of the asynchronous one as ordinary calls.

Calls may come from any thread. A stop precedes all waiting requests of other threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from steptwin.drivers.blocking import BlockingJog, BlockingLine, blocking, finish
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486.download import DownloadProgress
from steptwin.drivers.m1486.driver import TIMEOUT_S, AsyncM1486, ChipStatus
from steptwin.drivers.m1486.driver import download_to as async_download_to
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.lines import BAUD, ThreadM1486Line
from steptwin.drivers.m1486.settings import ChipSettings
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.subject import PERIOD_S, AsyncDeviceSubject, DeviceSubject
from steptwin.drivers.threads import ThreadLine
from steptwin.m1486.variants import Variant


class M1486Line(BlockingLine):
    """A line of chips that several drivers and threads share. ``with`` opens and closes it."""

    _driver: ThreadM1486Line

    def __init__(self, address: str, *, baud: int = BAUD, log: Callable[[str], object] | None = None) -> None:
        super().__init__(ThreadM1486Line(address, baud=baud, log=log))

    @property
    def place(self) -> str:
        return self._driver.place

    @property
    def line(self) -> ThreadM1486Line:
        """The line that drivers use."""
        return self._driver

    open = blocking(ThreadM1486Line.open)
    close = blocking(ThreadM1486Line.close)


class M1486Jog(BlockingJog):
    """A jog: ``with chip.jog(200.0) as jog: while pressed() and jog.hold(): pass``. See `AsyncM1486Jog`."""

    _driver: AsyncM1486Jog

    @property
    def end(self) -> str | None:
        """Why the motor has stopped; None while it runs."""
        return self._driver.end

    @property
    def reach(self) -> float:
        """The longest distance that the motor moves after the last `hold`, in the unit of the chip."""
        return self._driver.reach

    hold = blocking(AsyncM1486Jog.hold)


class _ThreadM1486(AsyncM1486):
    def _own_line(self, address: str, baud: int, log: Callable[[str], object] | None) -> DriverLine[ChipRequest, bytes]:
        return ThreadM1486Line(address, baud=baud, log=log)


class M1486(BlockingLine):
    """A chip for threads; arguments as of `AsyncM1486`. ``with`` opens and closes it."""

    _driver: AsyncM1486

    def __init__(
        self,
        where: str | M1486Line | ThreadLine[ChipRequest, bytes],
        address: int | None = None,
        *,
        baud: int = BAUD,
        variant: str | None = None,
        steps_per_unit: float = 1.0,
        unit: str = "step",
        origin_u: int = 0,
        timeout_s: float = TIMEOUT_S,
        log: Callable[[str], object] | None = None,
    ) -> None:
        driver = _ThreadM1486(
            where.line if isinstance(where, M1486Line) else where,
            address,
            baud=baud,
            variant=variant,
            steps_per_unit=steps_per_unit,
            unit=unit,
            origin_u=origin_u,
            timeout_s=timeout_s,
            log=log,
        )
        super().__init__(driver)

    @property
    def place(self) -> str:
        return self._driver.line.place

    @property
    def address(self) -> int | None:
        return self._driver.address

    @property
    def unit(self) -> str:
        return self._driver.unit

    @property
    def variant(self) -> Variant:
        """The type; known once the chip is open."""
        return self._driver.variant

    @property
    def settings(self) -> ChipSettings:
        """The settings of the chip as far as drivers on this line have made them."""
        return self._driver.settings

    def known(self) -> ChipStatus:
        """Known state of the chip, as `status` returns it. Nothing is sent."""
        return self._driver.known()

    def jog(self, velocity: float) -> M1486Jog:
        """Run at a velocity (units/s) while it is held: a dead-man's switch. See `AsyncM1486Jog`."""
        return M1486Jog(self._driver.jog(velocity))

    def subject(self, name: str = "m1486", *, period_s: float = PERIOD_S) -> DeviceSubject:
        """The open device with the commands, points and events of a twin. It is polled for events while there are subscribers, at
        most once per ``period_s``."""
        return DeviceSubject(AsyncDeviceSubject(name, M1486Part(self._driver), period_s))

    download = blocking(AsyncM1486.download)
    open = blocking(AsyncM1486.open)
    open_line = blocking(AsyncM1486.open_line)
    close = blocking(AsyncM1486.close)
    counter = blocking(AsyncM1486.counter)
    position = blocking(AsyncM1486.position)
    variable = blocking(AsyncM1486.variable)
    flags = blocking(AsyncM1486.flags)
    functions = blocking(AsyncM1486.functions)
    status = blocking(AsyncM1486.status)
    interface = blocking(AsyncM1486.interface)
    byte = blocking(AsyncM1486.byte)
    is_busy = blocking(AsyncM1486.is_busy)
    inputs = blocking(AsyncM1486.inputs)
    configure = blocking(AsyncM1486.configure)
    set_position = blocking(AsyncM1486.set_position)
    set_output = blocking(AsyncM1486.set_output)
    set_flag = blocking(AsyncM1486.set_flag)
    set_function = blocking(AsyncM1486.set_function)
    set_limit = blocking(AsyncM1486.set_limit)
    set_variable = blocking(AsyncM1486.set_variable)
    reset = blocking(AsyncM1486.reset)
    move_to = blocking(AsyncM1486.move_to)
    move_by = blocking(AsyncM1486.move_by)
    run = blocking(AsyncM1486.run)
    seek = blocking(AsyncM1486.seek)
    start_program = blocking(AsyncM1486.start_program)
    stop = blocking(AsyncM1486.stop)
    recover = blocking(AsyncM1486.recover)
    stop_program = blocking(AsyncM1486.stop_program)
    wait = blocking(AsyncM1486.wait)
    command = blocking(AsyncM1486.command)
    run_block = blocking(AsyncM1486.run_block)
    uploaded = blocking(AsyncM1486.uploaded)


def download_to(
    chips: Iterable[M1486],
    text: str,
    *,
    first: M1486 | None = None,
    progress: DownloadProgress | None = None,
    name: str = "program",
) -> bytes:
    """Send a program that selects its chips with ``X`` to chips on one line; see `steptwin.drivers.m1486.driver.download_to`."""
    drivers = [chip._driver for chip in chips]
    return finish(async_download_to(drivers, text, first=None if first is None else first._driver, progress=progress, name=name))
