"""Contacts that drive inputs, alone or several in parallel or in series: switches actuated by an axis, and push-buttons.

All contacts may bounce. Positions in pulses of the axis.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import ClassVar, Protocol

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.motion.divisions import profile_of
from steptwin.motioncontroller import Drive
from steptwin.simulation.scheduler.chance import Chance
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName
from steptwin.state import Plain, Stateful

_RESTORED = object()
"""The version of a carriage whose next change was restored, not computed."""


class MovingPart(Protocol):
    """The moving part that actuates switches."""

    def version(self) -> object:
        """A value that changes whenever predictions become invalid."""
        ...

    def grid_position(self, now: Nanos) -> int:
        """Position, in whole steps of the grid on which its zones are."""
        ...

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        """First moment > ``after`` at which it reaches or passes ``position`` in ``direction``; None if never."""
        ...


class CountedPosition:
    """A carriage at the counted position of its drive, in pulses since power-on."""

    __slots__ = ("_drive",)

    def __init__(self, drive: Drive) -> None:
        self._drive = drive

    def version(self) -> object:
        return self._drive.revision

    def grid_position(self, now: Nanos) -> int:
        return self._drive.plan.count(now)

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        plan = self._drive.plan
        for begin, leg in profile_of(plan).legs(after):
            if leg == direction and (plan.count(begin) - position) * direction < 0:
                return plan.pulse_time(position, max(begin, after))
        return None


@dataclass(frozen=True, slots=True)
class Zone:
    """Where a switch is on: from ``low`` to ``high`` (None: open), once on up to ``hysteresis`` further on both sides.

    With ``period`` (pulses) the zone repeats after each, in both directions, each time at the pulse nearest to it.
    """

    low: int | None
    high: int | None
    hysteresis: int = 0
    period: Fraction | int | None = None

    def __post_init__(self) -> None:
        if self.low is not None and self.high is not None and self.low > self.high:
            raise Misuse(f"low {self.low} imp is above high {self.high} imp")
        if self.hysteresis < 0:
            raise Misuse(f"a hysteresis of {self.hysteresis} imp is negative")
        if self.period is None:
            return
        if self.low is None or self.high is None:
            raise Misuse("a periodic zone needs both limits")
        width = self.high - self.low + 1 + 2 * self.hysteresis
        if width >= self.period:
            raise Misuse(
                f"a zone of {width} imp, hysteresis included, repeats every {float(self.period):g} imp: it must be shorter"
            )

    def _turn(self, place: int, period: Fraction | int) -> int:
        """The last turn whose zone, with hysteresis, begins at or below ``place``."""
        return ceil((place - (self.low or 0) + self.hysteresis + Fraction(1, 2)) / period) - 1

    def _ends(self, shift_p: Fraction | int) -> tuple[int, int]:
        """The zone, moved by ``shift_p``."""
        shift = floor(shift_p + Fraction(1, 2))
        return (self.low or 0) + shift, (self.high or 0) + shift

    def _near(self, place: int) -> tuple[int | None, int | None]:
        """The zone that ``place`` is in, hysteresis included, or else the last one below it."""
        period = self.period
        return (self.low, self.high) if period is None else self._ends(self._turn(place, period) * period)

    def on(self, place: int, *, was_on: bool) -> bool:
        low, high = self._near(place)
        more = self.hysteresis if was_on else 0
        return (low is None or place >= low - more) and (high is None or place <= high + more)

    def edges(self, place: int, *, is_on: bool) -> tuple[int | None, int | None]:
        """Positions at which the state changes next, below and above ``place``."""
        low, high = self._near(place)
        if is_on:
            more = self.hysteresis
            return None if low is None else low - more - 1, None if high is None else high + more + 1
        if self.period is None:
            below = high if high is not None and place > high else None
            above = low if low is not None and place < low else None
            return below, above
        turn = self._turn(place, self.period)
        if low is not None and place < low:
            return self._ends((turn - 1) * self.period)[1], low
        return high, self._ends((turn + 1) * self.period)[0]


class Circuit:
    """The contacts of an input: in series it is 1 while all are closed, else while any is."""

    __slots__ = ("_scheduler", "contacts", "in_series", "target")

    def __init__(self, scheduler: Scheduler, target: PinName, *, in_series: bool = False) -> None:
        scheduler.check(target)
        self._scheduler = scheduler
        self.target = target
        self.in_series = in_series
        self.contacts: list[Contact] = []

    @property
    def controller(self) -> str:
        """The subject of the records of its contacts."""
        return self._scheduler.owner(self.target.controller)

    @property
    def is_blank(self) -> bool:
        """Whether the state of its contacts is restored later."""
        return self._scheduler.is_blank

    def close(self) -> None:
        """Set the input to the present state of its contacts."""
        levels = [contact.level for contact in self.contacts]
        self._scheduler.drive(self.target, float(all(levels) if self.in_series else any(levels)))

    def notify(self) -> None:
        """One of the contacts bounces from now on."""
        self._scheduler.notify(self.target.controller)

    def report(self, channel: str, level: float) -> None:
        """The level of one contact, apart from the others of the input."""
        self._scheduler.record(self.controller, "edge", channel, level)


class Contact(Stateful):
    """A contact that may bounce. ``closed`` is what it comes to rest at.

    A change bounces ``bounces`` times, at moments drawn from ``chance``, and rests within ``bounce_ns``. Its level is recorded
    as ``channel``.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_circuit", "channel", "normally_closed")
    __slots__ = (*FIXED, "_bouncing", "_chance", "_due", "bounce_ns", "bounces", "closed", "level")

    def __init__(
        self, circuit: Circuit, *, normally_closed: bool, bounce_ns: Nanos, bounces: int, chance: Chance, channel: str = ""
    ) -> None:
        self._circuit = circuit
        self._chance = chance
        self._bouncing: deque[Nanos] = deque()
        self._due: Nanos | None = None
        self.channel = channel
        self.normally_closed = normally_closed
        self.bounce_ns = bounce_ns
        self.bounces = bounces
        self.closed = normally_closed
        self.level = normally_closed
        circuit.contacts.append(self)

    @property
    def controller(self) -> str:
        """The subject of its records."""
        return self._circuit.controller

    def rest_at(self, closed: bool) -> None:
        """Set its initial state; `Circuit.close` sets the input."""
        self.closed = self.level = closed
        if not self._circuit.is_blank:
            self._report()

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
        self._report()
        self._circuit.close()

    def _report(self) -> None:
        if self.channel:
            self._circuit.report(self.channel, float(self.level))


class Button(Contact):
    """A push-button, operated by external inputs."""

    __slots__ = ()

    def press(self, pressed: bool, now: Nanos) -> None:
        """Press or release it."""
        self.change(pressed is not self.normally_closed, now)
        self._circuit.notify()

    @property
    def pressed(self) -> bool:
        return self.closed is not self.normally_closed

    update, deadline = Contact.bounce, Contact.bounce_due


class Switch(Contact):
    """A switch that is on while a carriage is in its zone."""

    FIXED: ClassVar[tuple[str, ...]] = ("_carriage", "_version", "zone")
    __slots__ = (*FIXED, "on")

    def __init__(
        self,
        circuit: Circuit,
        carriage: MovingPart,
        zone: Zone,
        now: Nanos,
        *,
        normally_closed: bool = False,
        bounce_ns: Nanos = 0,
        bounces: int = 0,
        chance: Chance | None = None,
        channel: str = "",
    ) -> None:
        chance = chance or Chance(0, str(circuit.target))
        super().__init__(
            circuit, normally_closed=normally_closed, bounce_ns=bounce_ns, bounces=bounces, chance=chance, channel=channel
        )
        self._carriage = carriage
        self._version: object = None
        """Version of the carriage when its next change was computed; None before, `_RESTORED` after a restored snapshot."""
        self.zone = zone
        self.on = not circuit.is_blank and zone.on(carriage.grid_position(now), was_on=False)
        self.rest_at(self.on is not normally_closed)

    def update(self, now: Nanos) -> None:
        if self._bouncing:
            self.bounce(now)
        version = self._carriage.version()
        is_same = version == self._version or self._version is _RESTORED
        self._version = version
        if is_same and (self._due is None or self._due > now):
            return
        position = self._carriage.grid_position(now)
        self.on = self.zone.on(position, was_on=self.on)
        self.change(self.on is not self.normally_closed, now)
        self._predict(position, now)

    def _predict(self, place: int, now: Nanos) -> None:
        below, above = self.zone.edges(place, is_on=self.on)
        down = None if below is None else self._carriage.reaches(below, now, -1)
        up = None if above is None else self._carriage.reaches(above, now, 1)
        self._due = up if down is None else down if up is None else min(up, down)

    def set_state(self, plain: Plain) -> None:
        """As `Stateful.set_state`. Its next change is restored with it: in a snapshot everything has settled."""
        super().set_state(plain)
        self._version = _RESTORED

    def deadline(self) -> Nanos | None:
        due = self.bounce_due()
        return self._due if due is None else due if self._due is None else min(due, self._due)


@dataclass(frozen=True, slots=True)
class PositionSwitch:
    """A switch that is on while an axis is between ``low`` and ``high`` (counted pulses since power-on; None is unbounded).

    ``axis`` counts from 1. ``normally_closed`` gives 0 while the switch is on.
    """

    controller: str
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


def place(scheduler: Scheduler, switch: PositionSwitch) -> None:
    """Add a switch and drive its input to the present state."""
    scheduler.check(switch.target)
    try:
        drive = scheduler.drive_of(switch.controller, switch.axis)
    except Misuse as error:
        raise Misuse(f"switch on {switch.target}: {error}") from None
    zone = Zone(switch.low, switch.high)
    circuit = Circuit(scheduler, switch.target)
    scheduler.add_part(
        Switch(circuit, CountedPosition(drive), zone, scheduler.now, normally_closed=switch.normally_closed), (switch.controller,)
    )
    circuit.close()
