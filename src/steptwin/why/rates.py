"""The rates of integrators, noted while a world runs: which of the signals of a rate moved the value up or down."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.components.integrator import INTEGRATOR, Integrator
from steptwin.simulation.logic.expression import parse_expression
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.integral import Straight
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.world.simulation import Simulation


class NotedRate(NamedTuple):
    """The rate of an integrator from ``time`` on, and the lines on which the signals of it are."""

    time: Nanos
    rate: Straight
    lines: Mapping[str, Straight]

    def values(self, now: Nanos) -> dict[str, float]:
        """Those of the signals at a moment before the next rate."""
        return {name: float(line.value + line.slope * (now - self.time)) for name, line in self.lines.items()}

    def direction(self, now: Nanos) -> int:
        """Whether the value rises (1), falls (-1) or stands (0) at a moment before the next rate."""
        rate = self.rate.value + self.rate.slope * (now - self.time)
        return (rate > 0) - (rate < 0)


class NotedRates:
    """Notes each new rate of all integrators of ``world`` from now on."""

    def __init__(self, world: Simulation) -> None:
        self._of = {name: _OfIntegrator(world, one) for name, one in world.objects.built(INTEGRATOR).items()}
        for name, one in self._of.items():
            world.objects.scheduler_of[name].subscribe(one, (name,))

    def has(self, name: str) -> bool:
        """Whether it is an integrator."""
        return name in self._of

    def drivers(self, name: str, until: Nanos) -> tuple[str, ...]:
        """The signals whose last changes before a moment, or whose values from the beginning, moved the value of an integrator
        the way in which that went last."""
        return tuple(self._of[name].drivers(until))

    def since(self, name: str, signal: str, until: Nanos) -> Nanos:
        """Since when a signal of the rate of an integrator has the value that it has just before a moment; the moment itself for
        one that changes until then, or has that value since before anything was noted."""
        return self._of[name].since(signal, until)

    def last(self, name: str, until: Nanos) -> NotedRate:
        """The rate with which the value of an integrator changed last before a moment."""
        return self._of[name].last(until)[0]


class _OfIntegrator:
    """As `steptwin.simulation.scheduler.subscribers.SchedulerSubscriber`."""

    def __init__(self, world: Simulation, integrator: Integrator) -> None:
        self._integrator = integrator
        rate = parse_expression(integrator.spec.rate)
        signals = {name: world.signal(name) for name in dict.fromkeys(rate.names())}
        self._signals = {name: signal for name, signal in signals.items() if isinstance(signal, SignalOf)}
        self._rate = rate.in_unit("", lambda name: self._signals[name].unit)
        self._noted = [self._read(world.now)]
        self._seen: object = None
        """The plans and levels that were read last: reading them again takes exact fractions."""

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        levels = [signal.version() if signal.continuous else signal.value(now) for signal in self._signals.values()]
        seen = self._integrator.plan, levels
        if seen == self._seen:
            return
        self._seen = seen
        noted, last = self._read(now), self._noted[-1]
        goes_on = _at(last.rate, now - last.time) == noted.rate[:2]
        if not (goes_on and all(_at(line, now - last.time) == noted.lines[name][:2] for name, line in last.lines.items())):
            self._noted.append(noted)

    def _read(self, now: Nanos) -> NotedRate:
        lines = {
            name: Straight(exact_fraction(signal.value(now))) if signal.straight is None else signal.straight(now)
            for name, signal in self._signals.items()
        }
        return NotedRate(now, self._integrator.rate_line(now), lines)

    def last(self, until: Nanos) -> tuple[NotedRate, Nanos]:
        """The last rate before a moment with which the value changed, and until when it did, at most that moment."""
        end = until
        for one in reversed(self._noted):
            if one.time < until:
                if one.direction(end - 1):
                    return one, end
                end = one.time
        return self._noted[0], until

    def since(self, signal: str, until: Nanos) -> Nanos:
        before = [one for one in self._noted if one.time < until]
        value = before[-1].lines[signal].value if before else None
        since = until
        for one in reversed(before):
            line = one.lines[signal]
            if line.slope or line.value != value:
                return since
            since = one.time
        return until

    def drivers(self, until: Nanos) -> Iterator[str]:
        rate, end = self.last(until)
        direction, values = rate.direction(end - 1), rate.values(end - 1)
        here = self._rate.value(values.__getitem__)
        for name, value in values.items():
            other = values | {name: self._before(name, value, rate.time)}
            if (here - self._rate.value(other.__getitem__)) * direction > 0:
                yield name

    def _before(self, name: str, value: float, until: Nanos) -> float:
        """Value of a signal before its last change; 0 for one that has not changed."""
        noted = (one for one in reversed(self._noted) if one.time <= until)
        return next((float(one.lines[name].value) for one in noted if one.lines[name].value != value), 0.0)


def _at(line: Straight, later: Nanos) -> tuple[Fraction, Fraction]:
    """Value and slope of a line so much later."""
    return line.value + line.slope * later, line.slope
