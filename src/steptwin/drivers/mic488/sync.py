"""The MIC488 driver for threads: the methods of the asynchronous one as ordinary calls.

Calls may come from any thread. A stop precedes all waiting requests of other threads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Generic

from steptwin.drivers.blocking import Blocking, BlockingJog, BlockingLine, blocking, finish
from steptwin.drivers.line import DriverLine
from steptwin.drivers.mic488.axis import AsyncMic488Axis
from steptwin.drivers.mic488.driver import TIMEOUT_S, AsyncMic488
from steptwin.drivers.mic488.jog import HOLD_S, AsyncMic488Jog
from steptwin.drivers.mic488.lines import FRAMES_PER_SECOND, ThreadModbusLine
from steptwin.drivers.mic488.motion import MoveEnd
from steptwin.drivers.mic488.program import AsyncMic488Program
from steptwin.drivers.mic488.subject import Mic488Part
from steptwin.drivers.mic488.user import AsyncUserRegisters, AsyncUserView, Number
from steptwin.drivers.modbus import ModbusQuery
from steptwin.drivers.subject import PERIOD_S, AsyncDeviceSubject, DeviceSubject
from steptwin.drivers.threads import ThreadLine
from steptwin.mic488.config import ControllerConfig


class ModbusLine(BlockingLine):
    """A Modbus line that several drivers and threads share. ``with`` opens and closes it."""

    _driver: ThreadModbusLine

    def __init__(
        self,
        address: str,
        *,
        baud: int = 38400,
        frames_per_second: float | None = FRAMES_PER_SECOND,
        log: Callable[[str], object] | None = None,
    ) -> None:
        super().__init__(ThreadModbusLine(address, baud=baud, frames_per_second=frames_per_second, log=log))

    @property
    def place(self) -> str:
        return self._driver.place

    @property
    def line(self) -> ThreadModbusLine:
        """The line that drivers use."""
        return self._driver

    open = blocking(ThreadModbusLine.open)
    close = blocking(ThreadModbusLine.close)


class Mic488Jog(BlockingJog):
    """A jog of one axis: ``with axis.jog(5.0) as jog: while pressed() and jog.hold(): pass``. See `AsyncMic488Jog`."""

    _driver: AsyncMic488Jog

    @property
    def end(self) -> MoveEnd | None:
        """Why the axis has stopped; None while it runs."""
        return self._driver.end

    @property
    def reach_u(self) -> float:
        """The longest distance the axis moves after the last `hold`, in u."""
        return self._driver.reach_u

    hold = blocking(AsyncMic488Jog.hold)
    release = blocking(AsyncMic488Jog.release)


class Mic488Axis(Blocking):
    """One axis; see `AsyncMic488Axis`."""

    _driver: AsyncMic488Axis

    @property
    def number(self) -> int:
        return self._driver.number

    @property
    def unit(self) -> str:
        """Name of the configured unit; ``u`` if unknown."""
        return self._driver.unit

    def jog(self, velocity_u: float, *, hold_s: float = HOLD_S) -> Mic488Jog:
        """Run at a velocity (u/s) while it is held: a dead-man's switch. See `AsyncMic488Axis.jog`."""
        return Mic488Jog(self._driver.jog(velocity_u, hold_s=hold_s))

    status = blocking(AsyncMic488Axis.status)
    position = blocking(AsyncMic488Axis.position)
    velocity = blocking(AsyncMic488Axis.velocity)
    encoder = blocking(AsyncMic488Axis.encoder)
    enable = blocking(AsyncMic488Axis.enable)
    disable = blocking(AsyncMic488Axis.disable)
    set_position = blocking(AsyncMic488Axis.set_position)
    set_ramp = blocking(AsyncMic488Axis.set_ramp)
    set_limits = blocking(AsyncMic488Axis.set_limits)
    move_to = blocking(AsyncMic488Axis.move_to)
    move_by = blocking(AsyncMic488Axis.move_by)
    move_velocity = blocking(AsyncMic488Axis.move_velocity)
    home = blocking(AsyncMic488Axis.home)
    wait = blocking(AsyncMic488Axis.wait)
    stop = blocking(AsyncMic488Axis.stop)
    jog_bit = blocking(AsyncMic488Axis.jog_bit)


class Mic488Program(Blocking):
    """The program in the controller; see `AsyncMic488Program`."""

    _driver: AsyncMic488Program

    state = blocking(AsyncMic488Program.state)
    select = blocking(AsyncMic488Program.select)
    start = blocking(AsyncMic488Program.start)
    pause = blocking(AsyncMic488Program.pause)
    stop = blocking(AsyncMic488Program.stop)


class UserView(Blocking, Generic[Number]):
    """User registers as numbers of one type; see `AsyncUserView`."""

    # `blocking` would lose the type of the numbers.
    _driver: AsyncUserView[Number]

    def __init__(self, driver: AsyncUserView[Number]) -> None:
        super().__init__(driver)

    def read(self, number: int) -> Number:
        """The value at user register ``number``."""
        return finish(self._driver.read(number))

    def read_many(self, number: int, count: int) -> list[Number]:
        """``count`` values from user register ``number`` on."""
        return finish(self._driver.read_many(number, count))

    def write(self, number: int, value: Number) -> None:
        finish(self._driver.write(number, value))

    def write_many(self, number: int, values: Sequence[Number]) -> None:
        """Write values from user register ``number`` on, up to 61 DINTs or REALs or 122 others at one moment."""
        finish(self._driver.write_many(number, values))


class UserRegisters(Blocking):
    """The user registers; see `AsyncUserRegisters`."""

    _driver: AsyncUserRegisters

    def __init__(self, driver: AsyncUserRegisters) -> None:
        super().__init__(driver)
        self.words: UserView[int] = UserView(driver.words)
        self.ints: UserView[int] = UserView(driver.ints)
        self.dints: UserView[int] = UserView(driver.dints)
        self.reals: UserView[float] = UserView(driver.reals)

    save = blocking(AsyncUserRegisters.save)
    load = blocking(AsyncUserRegisters.load)
    zero = blocking(AsyncUserRegisters.zero)


class _ThreadMic488(AsyncMic488):
    def _own_line(self, address: str, baud: int, log: Callable[[str], object] | None) -> DriverLine[ModbusQuery, bytes]:
        return ThreadModbusLine(address, baud=baud, log=log)


class Mic488(BlockingLine):
    """A MIC488 for threads; arguments as of `AsyncMic488`. ``with`` opens and closes it."""

    _driver: AsyncMic488

    def __init__(
        self,
        where: str | ModbusLine | ThreadLine[ModbusQuery, bytes],
        unit: int = 1,
        *,
        baud: int = 38400,
        firmware: str | None = None,
        config: str | Path | ControllerConfig | None = None,
        scales: Sequence[tuple[str, float]] = (),
        timeout_s: float = TIMEOUT_S,
        observe: bool = False,
        log: Callable[[str], object] | None = None,
    ) -> None:
        place = where.line if isinstance(where, ModbusLine) else where
        driver = _ThreadMic488(
            place, unit, baud=baud, firmware=firmware, config=config, scales=scales, timeout_s=timeout_s, observe=observe, log=log
        )
        super().__init__(driver)
        self._axes = {number: Mic488Axis(driver.axis(number)) for number in range(1, 5)}
        self.program = Mic488Program(driver.program)
        self.user = UserRegisters(driver.user)

    @property
    def place(self) -> str:
        return self._driver.line.place

    @property
    def unit(self) -> int:
        return self._driver.unit

    @property
    def firmware(self) -> str:
        return self._driver.firmware

    @property
    def config(self) -> ControllerConfig | None:
        return self._driver.config

    def axis(self, number: int) -> Mic488Axis:
        """Axis 1 to 4."""
        return self._axes[self._driver.axis(number).number]

    def subject(self, name: str = "mic488", *, period_s: float = PERIOD_S) -> DeviceSubject:
        """The open device with the commands, points and events of a twin. It is polled for events while there are subscribers, at
        most once per ``period_s``."""
        return DeviceSubject(AsyncDeviceSubject(name, Mic488Part(self._driver), period_s))

    open = blocking(AsyncMic488.open)
    close = blocking(AsyncMic488.close)
    status = blocking(AsyncMic488.status)
    positions = blocking(AsyncMic488.positions)
    inputs = blocking(AsyncMic488.inputs)
    outputs = blocking(AsyncMic488.outputs)
    set_output = blocking(AsyncMic488.set_output)
    enable = blocking(AsyncMic488.enable)
    disable = blocking(AsyncMic488.disable)
    stop = blocking(AsyncMic488.stop)
    stop_all = blocking(AsyncMic488.stop_all)
    halt = blocking(AsyncMic488.halt)
    move_together = blocking(AsyncMic488.move_together)
    move_together_by = blocking(AsyncMic488.move_together_by)
    run_together = blocking(AsyncMic488.run_together)
    wait = blocking(AsyncMic488.wait)
    set_jog_speed = blocking(AsyncMic488.set_jog_speed)
    get = blocking(AsyncMic488.get)
    get_shown = blocking(AsyncMic488.get_shown)
    set = blocking(AsyncMic488.set)
    registers = blocking(AsyncMic488.registers)
    request = blocking(AsyncMic488.request)
    take_snapshot = blocking(AsyncMic488.take_snapshot)
    restore_snapshot = blocking(AsyncMic488.restore_snapshot)
