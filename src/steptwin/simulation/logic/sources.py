"""Sources of analog inputs: constant, ramp, sine, table. Volts over seconds of the world's time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import ClassVar, Protocol

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.motion.trig import sine
from steptwin.simulation.scheduler.scheduler import Scheduler, Source
from steptwin.simulation.scheduler.wires import PinName
from steptwin.state import Stateful

LOWEST_V, HIGHEST_V = 0.0, 10.0
RESOLUTION_V = 0.001
"""Resolution of the voltage."""


class Waveform(Protocol):
    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest voltage."""
        ...

    def volts(self, t_s: float) -> float: ...
    def rests(self, t_s: float) -> bool:
        """Whether the voltage is constant from ``t_s`` on."""
        ...


@dataclass(frozen=True, slots=True)
class ConstantWaveform:
    value: float

    @property
    def bounds(self) -> tuple[float, float]:
        return self.value, self.value

    def volts(self, t_s: float) -> float:
        return self.value

    def rests(self, t_s: float) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class TableWaveform:
    """Points (seconds, volts), interpolated linearly; constant before the first and after the last.

    ``repeat_s``: the period, if it repeats.
    """

    points: tuple[tuple[float, float], ...]
    repeat_s: float | None = None

    def __post_init__(self) -> None:
        times = [time for time, _ in self.points]
        if not times or times != sorted(set(times)):
            raise Misuse("the points of a table need times that grow")

    @property
    def bounds(self) -> tuple[float, float]:
        volts = [volts for _, volts in self.points]
        return min(volts), max(volts)

    def volts(self, t_s: float) -> float:
        if self.repeat_s is not None:
            t_s -= t_s // self.repeat_s * self.repeat_s
        i = bisect_right(self.points, t_s, key=lambda point: point[0])
        if i == 0:
            return self.points[0][1]
        if i == len(self.points):
            return self.points[-1][1]
        (t0, v0), (t1, v1) = self.points[i - 1], self.points[i]
        return v0 + (v1 - v0) * (t_s - t0) / (t1 - t0)

    def rests(self, t_s: float) -> bool:
        return self.repeat_s is None and t_s >= self.points[-1][0]


@dataclass(frozen=True, slots=True)
class SineWaveform:
    """``mean + amplitude · sin(360° · frequency · t + phase)``; phase in degrees."""

    mean: float
    amplitude: float
    frequency: float
    phase: float = 0.0

    @property
    def bounds(self) -> tuple[float, float]:
        return self.mean - abs(self.amplitude), self.mean + abs(self.amplitude)

    def volts(self, t_s: float) -> float:
        return self.mean + self.amplitude * sine(4.0 * (self.frequency * t_s + self.phase / 360.0))

    def rests(self, t_s: float) -> bool:
        return self.amplitude == 0.0 or self.frequency == 0.0


class AnalogSource(Stateful):
    """Drives an analog input with the voltage of a waveform, updated every ``period``."""

    FIXED: ClassVar[tuple[str, ...]] = ("_scheduler", "_waveform", "name", "period", "target")
    __slots__ = (*FIXED, "_due", "_plain", "is_broken", "offset")

    def __init__(self, scheduler: Scheduler, target: PinName, waveform: Waveform, period: Nanos, name: str = "") -> None:
        scheduler.check(target)
        if period < 1:
            raise Misuse(f"source of {target}: a period of {period} ns is not positive")
        lowest, highest = waveform.bounds
        if not LOWEST_V <= lowest <= highest <= HIGHEST_V:
            volts = f"{lowest:g}" if lowest == highest else f"{lowest:g} to {highest:g}"
            raise Misuse(f"source of {target}: {volts} V: an analog input takes {LOWEST_V:g} to {HIGHEST_V:g} V")
        self._scheduler = scheduler
        self._waveform = waveform
        self.name = name
        self.target = target
        self.is_broken = False
        """Fault: its wire is broken."""
        self.offset = 0.0
        """Fault: volts by which it is too high."""
        self._plain = 0.0
        """Volts of the waveform when it was renewed last."""
        self.period = period
        self._due: Nanos | None = scheduler.now

    @property
    def source(self) -> Source:
        return self._scheduler.source(self.name)

    def volts(self, now: Nanos) -> float:
        """The voltage that it gives."""
        return LOWEST_V if self.is_broken else self._shown(self._plain + self.offset)

    def own_volts(self) -> float:
        """The voltage that it would give without faults."""
        return self._shown(self._plain)

    @staticmethod
    def _shown(volts: float) -> float:
        return int(min(max(volts, LOWEST_V), HIGHEST_V) / RESOLUTION_V + 0.5) * RESOLUTION_V

    def update(self, now: Nanos) -> None:
        if self._due is not None and self._due <= now:
            t_s = now / SECOND
            self._plain = self._waveform.volts(t_s)
            self._due = None if self._waveform.rests(t_s) else now + self.period
        self._scheduler.drive(self.target, self.volts(now))

    def deadline(self) -> Nanos | None:
        return self._due
