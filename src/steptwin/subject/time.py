"""Advances the time of a world in this process."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.world.simulation import Simulation
from steptwin.subject.commands import Advance
from steptwin.subject.payloads import SHOWN_KINDS, STEP_KINDS
from steptwin.subject.subscriptions import Filter, Subscription, filter_of

LONGEST_RUN_NS: Nanos = 3600 * SECOND
"""A condition that never comes true is given up after an hour, where no other limit is given."""
MOST_SHOWN = 1000
"""Events in the answer to a step."""


TIME_HAS_PASSED = Message("subject.time-has-passed", "to_ns = {end}: this world is at {now} ns already")


def advance(world: Simulation, subscribe: Callable[[Filter, int], Subscription], wanted: Advance) -> Mapping[str, object]:
    """Execute a step in virtual time. ``subscribe``: `WorldSubject.subscribe`."""
    if wanted.until is not None:
        world.condition(wanted.until)  # raises `Misuse` here
    end = end_of(world, wanted, next_due(world))
    subscription = subscribe(shown_of(wanted), MOST_SHOWN)
    try:
        came = False
        if end is not None:
            if end < world.now:
                raise Misuse(TIME_HAS_PASSED(end=end, now=world.now))
            reason = world.run_to(end, wanted.until)
            came = reason is not None and reason == wanted.until
    finally:
        subscription.close()
    return {**happened(subscription), "came": came, "idle": end is None}


def shown_of(wanted: Advance) -> Filter:
    """The events in the answer to a step: levels and motions too, where the next thing is waited for."""
    is_next = wanted.duration is None and wanted.to is None and wanted.until is None
    return filter_of(STEP_KINDS if is_next else SHOWN_KINDS)


def happened(subscription: Subscription) -> dict[str, object]:
    """The events in the answer to a step."""
    missed, events = subscription.take()
    return {"events": [event.to_json() for event in events if event.is_shown or event.kind not in SHOWN_KINDS], "missed": missed}


def end_of(world: Simulation, wanted: Advance, due: Nanos | None) -> Nanos | None:
    """The moment to which a step goes; without a time that is ``due``, when something happens next by itself, None for never."""
    if wanted.to is not None:
        return wanted.to
    if wanted.duration is not None:
        return world.now + wanted.duration
    return due if wanted.until is None else world.now + LONGEST_RUN_NS


def next_due(world: Simulation) -> Nanos | None:
    """The next moment at which anything happens by itself; None when nothing will."""
    deadlines = [due for scheduler in world.schedulers if (due := scheduler.deadline()) is not None]
    own = world.next()
    due = min(deadlines if own is None else [*deadlines, own], default=None)
    return None if due is None else max(due, world.now)
