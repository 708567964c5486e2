"""The causes of changes of signals, also of those that are in no trace."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from steptwin.controller import Nanos
from steptwin.simulation.kinds.programs import Resource, ResourceKind
from steptwin.why.answer import Cover
from steptwin.why.chain import Cause, covered
from steptwin.why.controllers import axis_of
from steptwin.why.names import SLIPS, QuestionNames


class SignalChanges:
    """Finds the causes of changes by the names of signals. ``causes`` has the causes of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._names = QuestionNames(causes.log)

    def of(self, signals: Sequence[str], time: Nanos) -> Cause | None:
        """Cause of a change of one of these signals at a moment."""
        causes = self._all.of(time)
        if causes is None:
            return None
        log = causes.log
        last = causes.last([name for name in signals if (change := log.last_change(name, time)) and change.time == time], time)
        if last is not None:
            return last
        found = [cause for name in signals if (cause := self.unrecorded(name, time))]
        return max(found, key=lambda cause: cause.link.time, default=None)

    def unrecorded(self, signal: str, time: Nanos, since: Nanos | None = None) -> Cause | None:
        """Cause of what is in no trace at a moment; ``since``: since when it stands."""
        owner, _, rest = signal.partition(".")
        world, causes = self._all.log.world, self._all.of(time)
        if causes is None:
            return None
        if owner in world.axes and rest in SLIPS:
            return causes.axes.slipped(owner, time, SLIPS[rest])
        if owner in world.axes and rest != "power":
            return causes.axes.moved(owner, time, since=since)
        if owner in world.axes:
            drive, switched = world.axes[owner].spec.drive, causes.axes.power(owner, time)
            wanted = Resource(ResourceKind.AXIS, drive[1].removeprefix("M"))
            is_switched = switched is not None and switched.link.time == time
            return switched if is_switched else causes.controllers.at_moment(drive[0], time, wanted)
        if owner not in world.controllers:
            return causes.elements.of_element(owner, rest, time)
        shown = self._names.pin(signal)
        if shown != signal:
            pin = Resource(ResourceKind.PIN, shown.partition(".")[2])
            return covered(causes.programs.resource(owner, pin, 0, time) or causes.programs.first(owner, pin), Cover.LEVEL)
        wanted = axis_of(rest)
        if wanted is None and self._names.is_signal(signal) and world.signal(signal).continuous:
            wanted = Resource(ResourceKind.AXIS, "")
        if wanted is not None and wanted.kind is ResourceKind.AXIS and self._names.is_coordinate(signal):
            return causes.axes.coordinate(owner, wanted.name or "1", time)
        found = causes.controllers.at_moment(owner, time, wanted, rest)
        if found is None or wanted is None or "vel" not in rest.lower():
            return found
        besides, until = found.besides, found.place.time
        return found._replace(besides=lambda: (*besides(), *causes.axes.settings(owner, wanted.name, until)))
