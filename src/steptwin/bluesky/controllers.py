"""Controllers as devices of Bluesky. They are connected in the event loop of the RunEngine, which then owns the driver."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Protocol

from ophyd_async.core import Device, DeviceConnector, NotConnectedError

from steptwin.bluesky.analoginputs import AnalogInput, AnalogReadings
from steptwin.bluesky.labelledprograms import LabelledProgram
from steptwin.bluesky.motors import FlyingMotor, MotorPlace, MovingMotor, RampSettings
from steptwin.bluesky.programs import RunnableProgram
from steptwin.bluesky.readings import PointReadings
from steptwin.datasheet import Limits
from steptwin.drivers import AsyncMic488
from steptwin.drivers.m1486 import AsyncM1486
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.drivers.mic488.subject import Mic488Part
from steptwin.drivers.subject import DevicePart
from steptwin.errors import Misuse, SteptwinError
from steptwin.mic488.core import ANALOG_PINS


class OpenableDriver(Protocol):
    async def open(self) -> None: ...

    async def close(self) -> None: ...


class DriverConnector(DeviceConnector):
    """Opens the driver when the device is connected; nothing moves by that."""

    def __init__(self, driver: OpenableDriver, place: str, part: Callable[[], DevicePart]) -> None:
        super().__init__()
        self._driver = driver
        self._place = place
        self._make = part
        self._part: DevicePart | None = None

    async def connect_real(self, device: Device, timeout: float, force_reconnect: bool) -> None:
        if force_reconnect and self._part is not None:
            await self.close()
        if self._part is None:
            try:
                async with asyncio.timeout(timeout):
                    await self._driver.open()
            except (SteptwinError, TimeoutError) as error:
                raise NotConnectedError(str(error) or f"{self._place}: not open after {timeout:g} s") from error
            self._part = self._make()
        await super().connect_real(device, timeout, force_reconnect)

    async def close(self) -> None:
        self._part = None
        await self._driver.close()

    def part(self) -> DevicePart:
        """Raises `Misuse` before it is connected."""
        if self._part is None:
            raise Misuse(f"{self._place} is not connected")
        return self._part

    def motor_place(self, number: int) -> MotorPlace:
        """Place of the axis ``number``."""

        def positions() -> Limits | None:
            return None if self._part is None else self._part.datasheet.axes[number - 1].positions

        return MotorPlace(lambda: f"{self._place}/{number}", positions)


class Mic488Controller(Device):
    """The MIC488 of ``driver``: motors ``m1`` to ``m4`` in its units, ``readings`` of ``points``, a signal of each of the inputs
    ``analog``, and its ``program``."""

    def __init__(
        self,
        driver: AsyncMic488,
        points: Sequence[str] = (),
        name: str = "",
        *,
        analog: Mapping[str, AnalogInput] = MappingProxyType({}),
    ) -> None:
        """Raises `Misuse` for an analog input among ``points``: no register shows it."""
        for point in points:
            if point.upper() in ANALOG_PINS:
                raise Misuse(
                    f"points: no register shows {point}; a program that has $R100 = {point.upper()} copies it, and "
                    'analog={"NAME": AnalogInput("USER_REGISTER[100]:real", "UNIT")} reads it'
                )
        self.driver = driver
        place = f"{driver.line.place}/{driver.unit}"
        self._connection = connector = DriverConnector(driver, place, lambda: Mic488Part(driver))
        self.m1, self.m2, self.m3, self.m4 = (self._motor(number) for number in range(1, 5))
        self.readings = PointReadings(connector.part, points)
        self.analog = AnalogReadings(driver, lambda: place, analog)
        self.program = RunnableProgram(driver, lambda: place)
        super().__init__(name, connector)

    def _motor(self, number: int) -> FlyingMotor:
        names = [f"M{number}_{register}" for register in ("VMAX", "ACC", "DEC")]

        async def ramp() -> RampSettings:
            found = await self.driver.get(*names)
            return RampSettings(*(float(found[name]) for name in names))

        return FlyingMotor(self.driver.axis(number), self._connection.motor_place(number), ramp)

    async def close(self) -> None:
        """Close the line, unless it is shared. Axes are not stopped by it."""
        await self._connection.close()


class M1486Controller(Device):
    """The M1486 of ``driver``: ``motor`` in its unit, ``readings`` of ``points`` at rest, and the ``program`` in its command
    memory from ``label`` on. Its motor does not fly, because a chip does not tell its position in motion."""

    def __init__(self, driver: AsyncM1486, points: Sequence[str] = ("COUNTER",), name: str = "", *, label: int = 1) -> None:
        self.driver = driver
        place = driver.line.place if driver.address is None else f"{driver.line.place}/{driver.address}"
        self._connection = connector = DriverConnector(driver, place, lambda: M1486Part(driver))
        self.motor = MovingMotor(driver, connector.motor_place(1), poll_s=None)
        self.readings = PointReadings(connector.part, points)
        self.program = LabelledProgram(driver, lambda: place, label)
        super().__init__(name, connector)

    async def close(self) -> None:
        """Close the line, unless it is shared. The chip continues its motion."""
        await self._connection.close()
