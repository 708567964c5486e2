"""A session with a controller: its present values, and what the user does; it is found again after a lost connection."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field

from steptwin.drivers import AsyncMic488, AsyncMic488Jog, Mic488Status
from steptwin.drivers.address import text_of
from steptwin.drivers.mic488.frames import ObservedFrame
from steptwin.drivers.mic488.kind import of_mic488, unit_of
from steptwin.drivers.mic488.program import ProgramState
from steptwin.errors import Misuse, SteptwinError
from steptwin.live.twins import controller_of, find_device
from steptwin.mic488.registermap import RegisterMap
from steptwin.mic488.registers import register_map
from steptwin.monitor.values import FollowedValues, MonitorSource, MonitorValues, PolledValues

AGAIN_S = 1.0
"""Interval of attempts to reach a controller that does not respond, s."""
HZ = (0.2, 10.0)
JOG_HOLD_S = 0.2
"""Hold time of a jog after the last key, s: the shortest permitted."""
KEY_S = 0.25
"""Longest interval between repetitions of a held key, s."""


@dataclass(frozen=True, slots=True)
class Picture:
    """The result of the last reading. ``trouble``: why there was no answer; the other values are then previous ones."""

    status: Mic488Status | None = None
    values: MonitorValues = field(default_factory=dict)
    trouble: str | None = None


class MonitorSession:
    """Reads a controller. ``on_picture`` is called after every reading, ``on_frame`` for every frame of the driver.

    ``watched`` are names of registers to show besides the status. ``values`` gives both; without it the driver is polled.
    """

    def __init__(self, mic: AsyncMic488, place: str, hz: float, values: MonitorSource | None = None) -> None:
        if not HZ[0] <= hz <= HZ[1]:
            raise Misuse(f"--hz {hz:g}: permitted are {HZ[0]:g} to {HZ[1]:g}")
        self.mic = mic
        self.place = place
        self.picture = Picture(trouble="connecting")
        self.watched: Sequence[str] = ()
        self.on_picture: Callable[[Picture], object] = lambda _: None
        self.on_frame: Callable[[ObservedFrame], object] = lambda _: None
        self._values = PolledValues(mic) if values is None else values
        self._period_s = 1.0 / hz
        self._is_open = False
        self._at_once = asyncio.Event()
        self._jog: _Jogging | None = None
        self._ignored_until: float | None = None
        """Time until which a key still held after the end of its jog is ignored, s."""
        frames = mic.line.notes.get("frames")
        if frames is not None:
            frames.sinks.append(self._on_frame)

    def _on_frame(self, frame: ObservedFrame) -> None:
        self.on_frame(frame)

    @property
    def registers(self) -> RegisterMap:
        """The register map of the detected firmware; before detection that of the newest."""
        return register_map(self.mic.firmware)

    @property
    def is_connected(self) -> bool:
        return self.picture.trouble is None

    # ------------------------------------------------------------------ looking

    async def run(self) -> None:
        """Read values until cancelled."""
        try:
            while True:
                await self._look()
                self.on_picture(self.picture)
                self._at_once.clear()
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(self._period_s if self.is_connected else AGAIN_S):
                        await self._at_once.wait()
        finally:
            await self._values.close()
            await self.mic.close()

    async def _look(self) -> None:
        try:
            if not self._is_open:
                await self.mic.open()
                self._is_open = True
            elif not self.is_connected:
                await self.mic.find_firmware()
            self.picture = Picture(*await self._values.look(self.watched))
        except SteptwinError as error:
            self.picture = Picture(self.picture.status, {}, str(error))

    def watch(self, names: Sequence[str]) -> None:
        """Read these registers from now on."""
        self.watched = tuple(names)
        self._at_once.set()

    def look_soon(self) -> None:
        self._at_once.set()

    # ------------------------------------------------------------------ acting

    async def stop(self) -> str:
        """Stop all axes at once, without ramp. A running program is paused, because it could move them again.

        It precedes all waiting requests. Returns what was done, as text. Raises `Unconfirmed`.
        """
        self._jog = None
        self._ignore_held_key()
        await self.mic.halt()
        return "stopped; the program is paused" if await self.mic.program.state() is ProgramState.PAUSED else "stopped"

    async def jog(self, axis: int, velocity_u: float) -> str:
        """Handle a jog key, pressed or repeated. The axis runs as long as the key repeats.

        Another direction ends it. Returns the reason if it has ended other than by release; then, and after `stop`, a key still
        held has no effect.
        """
        if self._ignored_until is not None and asyncio.get_running_loop().time() < self._ignored_until:
            self._ignore_held_key()
            return ""
        jogging = self._jog
        if jogging is not None and not jogging.is_over:
            if (jogging.axis, jogging.velocity_u) == (axis, velocity_u):
                jogging.press()
            else:
                jogging.let_go()
            return ""
        jogging = self._jog = _Jogging(axis, velocity_u)
        try:
            async with self.mic.axis(axis).jog(velocity_u, hold_s=JOG_HOLD_S) as jog:
                await jogging.run(jog, lambda: self._jog is jogging)
        except SteptwinError:
            self._ignore_held_key()
            raise
        finally:
            jogging.is_over = True
        end = jog.end
        if end is None or end.ok:
            return ""
        self._ignore_held_key()
        return str(end)

    def _ignore_held_key(self) -> None:
        self._ignored_until = asyncio.get_running_loop().time() + KEY_S

    async def do(self, action: Awaitable[object]) -> None:
        """Execute an action, then read the values."""
        try:
            await action
        finally:
            self.look_soon()


class _Jogging:
    """A held key."""

    def __init__(self, axis: int, velocity_u: float) -> None:
        self.axis = axis
        self.velocity_u = velocity_u
        self.is_over = False
        self._pressed = asyncio.get_running_loop().time()
        self._is_let_go = False

    def press(self) -> None:
        self._pressed = asyncio.get_running_loop().time()

    def let_go(self) -> None:
        self._is_let_go = True

    async def run(self, jog: AsyncMic488Jog, is_wanted: Callable[[], bool]) -> None:
        loop = asyncio.get_running_loop()
        while not self._is_let_go and is_wanted() and loop.time() - self._pressed < KEY_S and await jog.hold():
            pass


def session_at(device: str | None, hz: float) -> MonitorSession:
    """A session with the controller that ``device`` names, as of `steptwin.live.twins.find_device`. A twin is followed."""
    address = of_mic488(find_device(device), "the monitor")
    mic = AsyncMic488(
        address.place,
        unit_of(address),
        baud=address.baud,
        firmware=address.variant,
        config=address.config,
        scales=address.scales,
        timeout_s=address.timeout,
        observe=True,
        log=lambda _: None,  # there have to be words for frames to be shown
    )
    twin = controller_of(device)
    return MonitorSession(mic, text_of(address), hz, None if twin is None else FollowedValues(twin))
