"""A signal that is calculated from others, of which at most one changes between events."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.logic.condition import Signal
from steptwin.simulation.logic.expression import value_of
from steptwin.simulation.logic.linear import check_linear
from steptwin.simulation.logic.quantities import Quantity

SEVERAL_MOVE = Message(
    "simulation.several-move", "{names} change between events: of the signals of an expression at most one may do so"
)


class CalculatedSignal:
    """Is monotonic where the one signal that moves is. Raises `Misuse` for an expression that is not, or over several of them."""

    unit = ""

    def __init__(self, quantity: Quantity, signals: Mapping[str, Signal], clock: Callable[[], Nanos]) -> None:
        """``clock`` gives the present moment of what computes the signals."""
        moving = [name for name, signal in signals.items() if signal.continuous]
        if len(moving) > 1:
            raise Misuse(SEVERAL_MOVE(names=moving))
        check_linear(quantity, moving)
        quantity = quantity.in_unit("", lambda name: signals[name].unit)
        self._value = value_of(quantity, {name: signal.value for name, signal in signals.items()})
        self._signals = tuple(signals.values())
        self._moving = signals[moving[0]] if moving else None
        self._resting = tuple(signal for signal in signals.values() if not signal.continuous)
        self._clock = clock

    @property
    def continuous(self) -> bool:
        return self._moving is not None

    def sync(self, now: Nanos) -> tuple[Any, ...]:
        return tuple(dict.fromkeys(source for signal in self._signals for source in signal.sync(now)))

    def value(self, now: Nanos) -> float:
        return self._value(now)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return iter(()) if self._moving is None else self._moving.turning_points(now)

    def version(self) -> object:
        """That of what moves, with the values of what does not."""
        moving = None if self._moving is None else self._moving.version()
        if self._moving is not None and moving is None:
            return None
        now = self._clock()
        return moving, tuple(signal.value(now) for signal in self._resting)
