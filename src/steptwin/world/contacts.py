"""Contacts that drive inputs: switches that an axis runs over, and buttons that a person presses. Both may bounce.

Positions in pulses of whatever carries the switch.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import ClassVar, Protocol

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.state import Stateful
from steptwin.world.chance import Chance
from steptwin.world.course import plan_of
from steptwin.world.kernel import Drive, Kernel, PinName


class Carriage(Protocol):
    """What runs over switches."""

    def version(self) -> object:
        """Another value whenever predictions no longer hold."""
        ...

    def place(self, now: Nanos) -> int: ...
    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        """First moment > ``after`` at which it has come to ``position`` going in ``direction``, or beyond; None if never."""
        ...


class CountedPosition:
    """A carriage that is where its drive has counted to, in pulses since power-on."""

    __slots__ = ("_drive",)

    def __init__(self, drive: Drive) -> None:
        self._drive = drive

    def version(self) -> object:
        return self._drive.revision

    def place(self, now: Nanos) -> int:
        return plan_of(self._drive).count(now)

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        plan = plan_of(self._drive)
        for begin, way in self._drive.profile.legs(after):
            if way == direction and (plan.count(begin) - position) * direction < 0:
                return plan.pulse_time(position, max(begin, after))
        return None


@dataclass(frozen=True, slots=True)
class Zone:
    """Where a switch is on: from ``low`` to ``high`` (None: open), once on up to ``hysteresis`` further on both sides.

    With ``period`` the zone comes again after so many pulses, in both directions.
    """

    low: int | None
    high: int | None
    hysteresis: int = 0
    period: int | None = None

    def __post_init__(self) -> None:
        if self.low is not None and self.high is not None and self.low > self.high:
            raise Misuse(f"low {self.low} imp is above high {self.high} imp")
        if self.hysteresis < 0:
            raise Misuse(f"a hysteresis of {self.hysteresis} imp is negative")
        if self.period is not None and (self.low is None or self.high is None or self.high - self.low >= self.period):
            raise Misuse(f"a zone that comes again every {self.period} imp must be shorter than that")

    def near(self, place: int) -> tuple[int | None, int | None]:
        """The edges that matter at ``place``: those of the zone it is in, or of the last one below it."""
        if self.period is None or self.low is None or self.high is None:
            return self.low, self.high
        shift = (place - self.low) // self.period * self.period
        return self.low + shift, self.high + shift

    def on(self, place: int, *, was_on: bool) -> bool:
        low, high = self.near(place)
        more = self.hysteresis if was_on else 0
        if self.period is not None and high is not None and low is not None and was_on and place >= low + self.period - more:
            return True
        return (low is None or place >= low - more) and (high is None or place <= high + more)

    def edges(self, place: int, *, is_on: bool) -> tuple[int | None, int | None]:
        """Positions at which the state changes next, below and above ``place``."""
        low, high = self.near(place)
        more = self.hysteresis
        if is_on:
            if self.period is not None and high is not None and low is not None and place > high + more:
                low, high = low + self.period, high + self.period
            return None if low is None else low - more - 1, None if high is None else high + more + 1
        if self.period is not None:
            if low is not None and high is not None and place <= high:
                return high - self.period, low
            return high, None if low is None else low + self.period
        below = high if high is not None and place > high else None
        above = low if low is not None and place < low else None
        return below, above


class Contact(Stateful):
    """A contact that may bounce. ``closed`` is what it comes to rest at.

    A change bounces ``bounces`` times, at moments drawn from ``chance``, and rests within ``bounce_ns``.
    """

    __slots__ = (
        "_bouncing",
        "_chance",
        "_due",
        "_kernel",
        "bounce_ns",
        "bounces",
        "closed",
        "level",
        "normally_closed",
        "target",
    )
    FIXED: ClassVar[frozenset[str]] = frozenset({"_kernel", "normally_closed", "target"})

    def __init__(
        self, kernel: Kernel, target: PinName, *, normally_closed: bool, bounce_ns: Nanos, bounces: int, chance: Chance
    ) -> None:
        kernel.check(target)
        self._kernel = kernel
        self._chance = chance
        self._bouncing: deque[Nanos] = deque()
        self._due: Nanos | None = None
        self.target = target
        self.normally_closed = normally_closed
        self.bounce_ns = bounce_ns
        self.bounces = bounces
        self.closed = normally_closed
        self.level = normally_closed

    def rest_at(self, closed: bool) -> None:
        """Its state before anything has happened."""
        self.closed = self.level = closed
        self._kernel.drive(self.target, float(closed))

    def change(self, closed: bool, now: Nanos) -> None:
        if closed == self.closed:
            return
        self.closed = closed
        self._bouncing.clear()
        self._put(closed)
        if self.bounce_ns > 0 and self.bounces > 0:
            moments = sorted(now + 1 + self._chance.below(self.bounce_ns) for _ in range(2 * self.bounces))
            self._bouncing.extend(moments)

    def bounce(self, now: Nanos) -> None:
        while self._bouncing and self._bouncing[0] <= now:
            self._bouncing.popleft()
            self._put(not self.level)

    def bounce_due(self) -> Nanos | None:
        return self._bouncing[0] if self._bouncing else None

    def _put(self, closed: bool) -> None:
        self.level = closed
        self._kernel.drive(self.target, float(closed))


class Button(Contact):
    """A button, pressed and released from outside."""

    __slots__ = ()

    def press(self, pressed: bool, now: Nanos) -> None:
        self.change(pressed is not self.normally_closed, now)
        self._kernel.mark()

    @property
    def pressed(self) -> bool:
        return self.closed is not self.normally_closed

    def look(self, now: Nanos) -> None:
        self.bounce(now)

    def deadline(self) -> Nanos | None:
        return self.bounce_due()


class Switch(Contact):
    """A switch that is on while a carriage stands in its zone."""

    __slots__ = ("_carriage", "_version", "on", "zone")
    FIXED: ClassVar[frozenset[str]] = frozenset({"_carriage", "_version", "zone"}) | Contact.FIXED

    def __init__(
        self,
        kernel: Kernel,
        carriage: Carriage,
        zone: Zone,
        target: PinName,
        *,
        normally_closed: bool = False,
        bounce_ns: Nanos = 0,
        bounces: int = 0,
        chance: Chance | None = None,
    ) -> None:
        chance = chance or Chance(0, str(target))
        super().__init__(kernel, target, normally_closed=normally_closed, bounce_ns=bounce_ns, bounces=bounces, chance=chance)
        self._carriage = carriage
        self._version: object = carriage.version()
        self.zone = zone
        self.on = zone.on(carriage.place(kernel.now), was_on=False)
        self.rest_at(self.on is not normally_closed)
        self._predict(carriage.place(kernel.now), kernel.now)

    def look(self, now: Nanos) -> None:
        if self._bouncing:
            self.bounce(now)
        version = self._carriage.version()
        if version == self._version and (self._due is None or self._due > now):
            return
        self._version = version
        place = self._carriage.place(now)
        self.on = self.zone.on(place, was_on=self.on)
        self.change(self.on is not self.normally_closed, now)
        self._predict(place, now)

    def _predict(self, place: int, now: Nanos) -> None:
        below, above = self.zone.edges(place, is_on=self.on)
        down = None if below is None else self._carriage.reaches(below, now, -1)
        up = None if above is None else self._carriage.reaches(above, now, 1)
        self._due = up if down is None else down if up is None else min(up, down)

    def deadline(self) -> Nanos | None:
        due = self.bounce_due()
        return self._due if due is None else due if self._due is None else min(due, self._due)


@dataclass(frozen=True, slots=True)
class PositionSwitch:
    """A switch that is on while an axis stands from ``low`` to ``high`` (counted pulses since power-on; None is open).

    ``axis`` counts from 1. ``normally_closed`` gives 0 while the switch is on.
    """

    machine: str
    axis: int
    low: int | None
    high: int | None
    target: PinName
    normally_closed: bool = False

    def __post_init__(self) -> None:
        try:
            Zone(self.low, self.high)
        except Misuse as error:
            raise Misuse(f"switch on {self.target}: {error}") from None


def place(kernel: Kernel, switch: PositionSwitch) -> None:
    """Add a switch; its input takes its present state at once."""
    kernel.check(switch.target)
    try:
        drive = kernel.drive_of(switch.machine, switch.axis)
    except Misuse as error:
        raise Misuse(f"switch on {switch.target}: {error}") from None
    zone = Zone(switch.low, switch.high)
    kernel.add_part(Switch(kernel, CountedPosition(drive), zone, switch.target, normally_closed=switch.normally_closed))
