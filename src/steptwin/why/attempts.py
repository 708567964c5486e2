"""Commands to axes that moved nothing: ignored, refused, or kept for a trigger that has not come."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.kinds.programs import Resource, ResourceKind, WriteUse
from steptwin.why import points
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, FoundCause, Place, covered, nothing
from steptwin.why.log import LAST

NOTHING_HAS_COMMANDED = Message("why.nothing-has-commanded", "nothing has commanded {axis} to move")
WAITS_FOR_TRIGGER = Message("why.waits-for-trigger", "{register} waits for {trigger}, as {mode} is {value:g}")


class Attempts:
    """Finds the commands by which an axis has not moved. ``causes`` has the causes of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world

    def last(self, controller: str, number: str, until: Nanos, before: int = LAST, after: Nanos = -1) -> FoundCause:
        """The last one by a moment, before an order, along with the others. ``after``: what was ignored before is over."""
        ignored = self._ignored(controller, number, until, before)
        registers = self._world.kind(controller).registers
        names = () if registers is None else registers.uses(number)
        refused = self._all.controllers.refused(controller, names, until, before, after)
        later = [] if ignored is None or (after >= 0 and not self._is_later(controller, number, ignored, after)) else [ignored]
        later += [] if refused is None else [refused]
        stays = self._all.axes.not_beyond(controller, number, until, after)
        later += [] if stays is None or stays.place.order >= before else [stays]
        found = sorted((*later, *self._kept(controller, number, until, before)), key=lambda one: one.place)
        return found[-1]._replace(along=(*found[-1].along, *found[:-1])) if found else None

    def _is_later(self, controller: str, number: str, ignored: Cause, after: Nanos) -> bool:
        """Whether an event is no end of a motion that began meanwhile."""
        plans = self._log.plans_in_force(controller, number, ignored.place.time, ignored.place.order)
        return ignored.place.time > after and all(plan.time <= after for plan in plans)

    def unmoved(self, controller: str, number: str, until: Nanos) -> FoundCause:
        """Reason why an axis of a controller has not moved by a moment."""
        if self._all.axes.motion(controller, number, until) is not None:
            return None
        found = self.last(controller, number, until)
        axis = Resource(ResourceKind.AXIS, number)
        found = found or self._all.controllers.unheard(controller, axis, until)
        found = (
            found
            or self._all.programs.before(controller, axis, until, Place(until, LAST, -2))
            or self._all.programs.made_in_vain(controller, axis, until)
        )
        if found is not None or not self._log.never_happened(f"event of axis {number}"):
            return found
        if controller in self._world.objects.line_of:
            self._log.lack()  # a request may have been refused before the log
        text = NOTHING_HAS_COMMANDED(axis=f"{controller}.M{number}")
        return Cause(ChainLink(0, controller, text), Place(0), nothing, Cover.LEVEL)

    def _ignored(self, controller: str, number: str, until: Nanos, before: int) -> FoundCause:
        """The last event about an axis, such as a command that its controller ignored."""
        event = self._log.last_axis_event(controller, number, until, before)
        if event is None:
            self._log.never_happened(f"event of axis {number}")
            return None
        return covered(self._all.controllers.axis_event(controller, event, Place(event.time, event.order)), Cover.LEVEL)

    def _kept(self, controller: str, number: str, until: Nanos, before: int) -> Iterator[Cause]:
        """Written registers whose values wait for a trigger."""
        registers = self._world.kind(controller).registers
        for register, use in ({} if registers is None else registers.uses(number)).items():
            series = self._log.points.series(f"{controller}.{use.mode}")
            if series is None or not points.level(series, until):
                continue
            written = self._all.controllers.written(controller, register, until, before)
            if written is None:
                self._log.lack()  # it may have been written before the log
            mode = 0.0 if written is None else points.level(series, written.place.time)
            if written is None or not mode:
                continue
            came = self._trigger(controller, use, written.place, until, before)
            if came is None or not self._selects(controller, use, came):
                yield self._waits(controller, register, use, mode, written, came)

    def _trigger(self, controller: str, use: WriteUse, written: Place, until: Nanos, before: int) -> FoundCause:
        """The write of the trigger of a register for its axis since that was written; without one the last one for others."""
        last = came = self._all.controllers.written(controller, use.trigger, until, before)
        while came is not None and came.place > written:
            if self._selects(controller, use, came):
                return came
            came = self._all.controllers.written(controller, use.trigger, came.place.time, came.place.order)
        return last if last is not None and last.place > written else None

    def _selects(self, controller: str, use: WriteUse, came: Cause) -> bool:
        """Whether a write of a trigger was for the axis of a register."""
        series = self._log.points.series(f"{controller}.{use.trigger}")
        return series is None or bool(int(points.level(series, came.place.time)) & use.bit)

    def _waits(self, controller: str, register: str, use: WriteUse, mode: float, written: Cause, other: FoundCause) -> Cause:
        """``other``: a write of the trigger that was for other axes."""
        text = WAITS_FOR_TRIGGER(register=f"{controller}.{register}", trigger=use.trigger, mode=use.mode, value=mode)
        time, order, number = written.place
        by = partial(self._all.controllers.register, controller, use.mode, None, time, order)
        besides = lambda: [one for one in (by(),) if one is not None]  # noqa: E731
        along = () if other is None else (other,)
        place = Place(time, order, number + 1)
        return Cause(ChainLink(time, controller, text), place, lambda: written, Cover.LEVEL, besides, along)
