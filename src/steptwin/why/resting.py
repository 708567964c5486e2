"""Causes of what has not changed: the places of axes, programs that are held or have decided otherwise, commands that moved
nothing."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Sequence
from functools import partial
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.simulation.kinds.programs import Resource, ResourceKind
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.axes import POSITION
from steptwin.why.chain import Cause, FoundCause, Place, along, covered, given
from steptwin.why.controllers import axis_of
from steptwin.why.log import LAST
from steptwin.why.notedpast import NotedPast
from steptwin.why.sentences import value_with_unit

VALUE = "value"
"""The signal of an integrator that is what it has in it."""
Resting: TypeAlias = Generator[None, None, FoundCause]


class RestingCauses:
    """Finds them in a past."""

    def __init__(self, past: NotedPast) -> None:
        self._past = past
        self._log, self._names, self._world = past.log, past.names, past.log.world

    def moved(self, signals: Sequence[str], at: Nanos) -> Resting:
        """Where an axis of `_axes_of` is, and what brought it there, or left it; of several the one moved last. None if nothing
        moved any."""
        axes = self._axes_of(signals, at)
        moved = [(cause.place, axis, cause) for axis in axes if (cause := self._past.causes.axes.moved(axis, at))]
        if not moved:
            return None
        _, axis, cause = max(moved, key=lambda one: one[:2])
        other, name = (yield from self._past.world_at(at)), f"{axis}.position"
        text = value_with_unit(name, other.read(name), other.signal(name).unit)
        return Cause(ChainLink(at, axis, text), Place(at, LAST, -1), lambda: covered(cause, Cover.LEVEL))

    def standing(self, signals: Sequence[str], at: Nanos) -> Resting:
        """The places of axes and values of integrators that nothing has moved, on which signals depend, and of the signals
        themselves. None if there are none."""
        behind = self._past.behind(signals, at)
        owners = {name.partition(".")[0] for name in behind}
        names = [f"{axis}.{POSITION}" for axis in sorted(owners & set(self._world.axes))]
        names += [f"{owner}.{VALUE}" for owner in sorted(owners) if self._log.rates.has(owner)]
        names += [
            one for one in signals if not self._log.has(one) and self._names.is_signal(one) and self._world.signal(one).continuous
        ]
        if not names:
            return self.ignored(signals, at)
        other, found = (yield from self._past.world_at(at)), list[Cause]()
        for number, name in enumerate(dict.fromkeys(names)):
            text = value_with_unit(name, other.read(name), other.signal(name).unit)
            place = Place(at, LAST, -1 - number)
            cause = self._of_standing(name, at)
            before = self._past.causes.at_begin if cause is None else partial(given, cause)
            found.append(Cause(ChainLink(at, name.partition(".")[0], text), place, before))
        return along(found[0], found[1:])

    def _of_standing(self, name: str, at: Nanos) -> FoundCause:
        """Cause for which a quantity has a value that it has from the beginning."""
        if name.partition(".")[0] in self._world.axes:
            return self.ignored((name,), at)
        ignored = self.ignored((name,), at)
        return ignored if ignored is not None else covered(self._past.causes.changes.unrecorded(name, at), Cover.LEVEL)

    def held(self, signals: Iterable[str], at: Nanos) -> Cause | None:
        """Cause for which a program does not change signals, or those that drive them: it is held, or has decided against it."""
        found: list[FoundCause] = []
        programs = self._past.causes.programs
        for name in self._past.behind(signals, at):
            owner, _, pin = name.partition(".")
            if owner in self._world.programs and not self._past.causes.drivers(name, at) and programs.may_write(owner, pin):
                found.append(programs.prevented(owner, Resource(ResourceKind.PIN, pin), at))
        return max((one for one in found if one is not None), key=lambda one: one.place, default=None)

    def ignored(self, signals: Iterable[str], at: Nanos) -> Cause | None:
        """Cause for which an axis of a controller has not moved: a command that was ignored, or that there was none."""
        for name in signals:
            owner, _, rest = name.partition(".")
            drive = self._world.axes[owner].spec.drive if owner in self._world.axes else (owner, rest)
            axis = axis_of(f"{drive[1]}.")
            moves = name == f"{owner}.position" or (self._names.is_signal(name) and self._world.signal(name).continuous)
            controller = self._world.controllers.get(drive[0])
            is_only = moves and controller is not None and len(controller.axes) == 1
            number = axis.name or "1" if axis is not None else "1" if is_only else ""
            if controller is not None and number and (moves or rest.lower().endswith("status")):
                return self._past.causes.attempts.unmoved(drive[0], number, at)
        return None

    def awaited(self, signals: Iterable[str], at: Nanos) -> Iterator[tuple[str, Resource]]:
        """All for which programs wait before they change signals, or those that drive them, with their controllers, and what
        interrupts change for which they loop. One that is paused or has no supply waits for nothing else."""
        programs = self._past.causes.programs
        for name in self._past.behind(signals, at):
            owner, _, pin = name.partition(".")
            index = self._log.last_executed(owner, at) if owner in self._world.programs else -1
            is_held = index >= 0 and programs.held(owner, at) is not None
            if index >= 0 and not is_held and programs.leads_to(owner, index, Resource(ResourceKind.PIN, pin), at):
                use = programs.use(owner, index)
                yield from ((owner, one) for one in use.reads if use.waits)
                loop = () if use.waits and use.reads else programs.conditions_of_loop(owner, index)
                counted = (one for number in loop for one in programs.use(owner, number).reads)
                yield from ((owner, one) for one in counted if any(self._past.causes.interrupts.changing(owner, one)))

    def awaited_pins(self, signals: Iterable[str], at: Nanos) -> Iterator[str]:
        """The pins among `awaited`."""
        yield from (
            f"{owner}.{one.name}" for owner, one in self.awaited(signals, at) if one.kind is ResourceKind.PIN and one.name
        )

    def _axes_of(self, signals: Iterable[str], at: Nanos) -> set[str]:
        """The axes whose position or switch is among signals, or drives one of them."""
        return {name.partition(".")[0] for name in self._past.behind(signals, at)} & set(self._world.axes)
