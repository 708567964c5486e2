"""Signals by name. Those of a controller are the points of its data sheet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TypeVar

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motioncontroller import MotionController
from steptwin.nearmiss import NearMiss, alike
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.logic import level_signal
from steptwin.simulation.faults.controller import FaultyController
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.simulation.kinds.lines import Line
from steptwin.simulation.logic.signal import SignalOf, SignalsOf
from steptwin.simulation.scheduler.scheduler import Source
from steptwin.simulation.toml.names import Unknown, UnknownSignal

T = TypeVar("T")

MOST_NAMED = 8
"""Number of points listed in a message."""
MOST_COMPARED = 40
"""Characters of an unknown name that are compared with others."""


class Idle:
    """The signal ``idle``: all controllers are idle and no transmission is pending. It tests the one that was busy last first."""

    continuous = False
    is_readable = True
    unit = ""
    freeze = None

    def __init__(self, plan: BuiltObjects) -> None:
        at_rest: dict[str, Callable[[Nanos], bool]] = {
            **{name: partial(plan.kind_of[name].is_idle, controller) for name, controller in plan.controllers.items()},
            **{name: partial(_is_quiet, line) for name, line in plan.lines.items()},
        }
        self._things = [(plan.scheduler_of[name].source(name), is_at_rest) for name, is_at_rest in at_rest.items()]
        self._sources = tuple(source for source, _ in self._things)
        self._busy: int | None = None
        """Index of the controller or line that was busy last."""

    def sync(self, now: Nanos) -> tuple[Source, ...]:
        """As `SignalOf.sync`: a busy controller or line, or all if none is busy."""
        for n in (*(() if self._busy is None else (self._busy,)), *range(len(self._things))):
            source, is_at_rest = self._things[n]
            source.scheduler.advance(now)
            if not is_at_rest(now):
                self._busy = n
                return (source,)
        self._busy = None
        return self._sources

    def watch(self, name: str) -> None:
        """Conditions can always use it."""

    def value(self, now: Nanos) -> float:
        """1 if idle, otherwise 0; after `sync`."""
        return float(self._busy is None)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        yield from ()

    def version(self) -> object:
        return None


SIGNAL_IS_LATER = Message(
    "simulation.signal-is-built-later",
    "no signal {name!r} yet: [[{table}]] {owner!r} is built later; elements cannot depend on each other",
)
NOTHING_IS_CALLED = Message(
    "simulation.nothing-is-called", "no signal {name!r}: nothing is called {owner!r}{hint}; there are {names}"
)


def find_signal(plan: BuiltObjects, name: str) -> SignalOf | Idle:
    """The signal called ``name``. Raises `Misuse` with the existing names."""
    if name == "time":
        return SignalOf((), _seconds, lambda now: (), lambda: name, unit="s", freeze=lambda now: _seconds)
    if name == "idle":
        return Idle(plan)
    owner, _, rest = name.partition(".")
    of_element = plan.element_signals(owner)
    if of_element is not None:
        return _chosen(of_element, rest, name)
    line = plan.lines.get(owner)
    if line is not None:
        return _chosen({"idle": _quiet(line, plan.scheduler_of[owner].source(owner))}, rest, name)
    controller = plan.controllers.get(owner)
    if controller is None:
        later = plan.unbuilt(owner)
        block = plan.scheduler_of[owner].terminal_blocks.get(owner) if owner in plan.terminals else None
        if block is not None and rest.upper() in block.levels:
            return level_signal(block, rest.upper())
        if later is not None:
            raise Unknown(owner, SIGNAL_IS_LATER(name=name, table=later, owner=owner))
        known = [*plan.controllers, *plan.element_names, "time", "idle"]
        near = NearMiss()
        text = NOTHING_IS_CALLED(name=name, owner=owner, hint=near.hint(owner, known), names=known)
        raise Unknown(owner, text, near.of(owner, known))
    return _of_controller(plan.kind_of[owner], controller, plan.scheduler_of[owner].source(owner), rest, name)


def _seconds(now: Nanos) -> float:
    return now / SECOND


def _of_controller(kind: AnyKind, controller: MotionController, source: Source, rest: str, name: str) -> SignalOf:
    """The signal of a pin, otherwise of a point of the data sheet."""
    pin = rest.upper()
    if pin in controller.pins():
        unit = kind.pins(controller)[pin].unit
        read = partial(_level, kind, controller, source, pin)
        return SignalOf((source,), read, unit=unit, check=partial(kind.refuse_taken, controller, pin))
    point = kind.point(controller, rest) if rest else None
    if point is None:
        raise _unknown([point.path for point in kind.datasheet(controller).points], rest, name, AND_PINS())
    return SignalOf(
        (source,), point.read, point.turning_points, point.version, point.point.unit, is_kept=point.is_kept, freeze=point.freeze
    )


def _level(kind: AnyKind, controller: MotionController, source: Source, pin: str, now: Nanos) -> float:
    """The level of a pin, for an output that a fault holds the one that all others see."""
    failing = source.scheduler.controllers[source.name]
    held = failing.held_outputs.get(pin) if isinstance(failing, FaultyController) else None
    return kind.state.pin(controller, pin, now) if held is None else held


def _quiet(line: Line, source: Source) -> SignalOf:
    """The signal ``idle`` of a line."""
    return SignalOf((source,), lambda now: float(_is_quiet(line, now)))


def _is_quiet(line: Line, now: Nanos) -> bool:
    """Whether no transmission is pending on a line."""
    return line.deadline() is None


def _chosen(known: Mapping[str, T], rest: str, name: str) -> T:
    found = known.get(rest.lower())
    if found is None and isinstance(known, SignalsOf) and rest.lower() in known.absent:
        raise Misuse(HAS_NO_SIGNAL(name=name, why=known.absent[rest.lower()]))
    if found is None:
        raise _unknown(list(known), rest, name)
    return found


AND_PINS = Message("simulation.and-pins", ", and pins")
AND_MORE = Message("simulation.and-more", " and more, {count} in all")
HAS_NO_SIGNAL = Message("simulation.has-no-signal", "no signal {name!r}: {why}")
NO_SIGNAL = Message("simulation.no-signal", "no signal {name!r}{hint}; there are {names}{more}{others}")


def _unknown(known: Sequence[str], rest: str, name: str, others: str = "") -> Misuse:
    """The error for an unknown name, with the names of the same axis if it names one; otherwise similar ones of an element come
    first, and numbered ones last."""
    axis, dot, _ = rest.rpartition(".")
    of_axis = [path for path in known if dot and path.upper().startswith(f"{axis.upper()}.")]
    similar = [] if others else alike(rest[:MOST_COMPARED], known)
    in_order = dict.fromkeys([*similar, *sorted(known, key=_is_numbered)])
    shown = of_axis or list(in_order)[:MOST_NAMED]
    more = "" if of_axis or len(shown) == len(known) else AND_MORE(count=len(known))
    near = NearMiss()
    meant = near.of(rest, known)
    return UnknownSignal(
        name,
        NO_SIGNAL(name=name, hint=near.hint(rest, known), names=shown, more=more, others="" if of_axis else others),
        None if meant is None else f"{name.removesuffix(rest)}{meant}",
    )


def _is_numbered(name: str) -> bool:
    return name[-1].isdigit()
