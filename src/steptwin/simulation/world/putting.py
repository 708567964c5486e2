"""Workpieces that scripts and programs put into a world, or take out of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message
from steptwin.simulation.components.beltgrip import BeltGrip
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.conveyor import CONVEYOR, Conveyor
from steptwin.simulation.components.gripper import GRIPPER
from steptwin.simulation.components.nest import NEST
from steptwin.simulation.components.vacuum import VACUUM
from steptwin.simulation.mechanics.belt import Placed
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.world.model import Model

A_CONVEYOR_OR_NEST = Message("simulation.conveyor-or-nest", "conveyor or nest")
NO_SIZE = Message("simulation.nest-without-workpiece", "{nest}: its table does not say how large its workpieces are")
ONLY_ON_BELTS = Message(
    "simulation.place-only-on-belts", "front = {front}: {nest} is a nest, which takes a workpiece into its first free cell"
)
BEYOND_END = Message("simulation.put-beyond-the-end", "front = {front} mm: permitted are 0 to {length:g}, the length of {belt}")
NO_NAME = Message("simulation.expected-the-name-of-one", "{given}: expected the name of a {what}")
NO_WORKPIECE_NAME = Message("simulation.no-name-of-a-workpiece", "{name}: expected the name of a workpiece, such as {example}")
NO_WORKPIECE = Message("simulation.workpiece-is-not-there", "there is no {workpiece} now")
NO_ROOM = Message("simulation.no-room-for-a-workpiece", "{on} has no room there for another workpiece")


class Act(NamedTuple):
    """The act to be done, and its scheduler."""

    scheduler: Scheduler
    do: Callable[[Nanos], object]


def put(model: Model, on: str, front: float | None) -> Act:
    """Put a new workpiece on a conveyor, its front at ``front`` mm, or into the first free cell of a nest. Raises
    `Misuse` for what is neither and for a place beyond its end, `Refusal` where there is no room now."""
    if not isinstance(on, str):
        raise Misuse(NO_NAME(given=repr(on), what=A_CONVEYOR_OR_NEST()))
    objects, now = model.objects, model.now
    conveyor, nest = objects.built(CONVEYOR).get(on), objects.built(NEST).get(on)
    if conveyor is not None:
        return _put_on_belt(conveyor, 0.0 if front is None else front, now)
    if nest is None:
        raise model.unknown(A_CONVEYOR_OR_NEST(), on, _sources(model))
    if nest.spec.workpiece is None:
        raise Misuse(NO_SIZE(nest=on))
    if front is not None:
        raise Misuse(ONLY_ON_BELTS(front=repr(front), nest=on))
    rest = nest.resting.next_in(nest.spec, now)
    if rest is None:
        raise Refusal(NO_ROOM(on=on))
    return Act(nest.block.scheduler, lambda now: nest.resting.add(nest.spec, rest))


def _put_on_belt(conveyor: Conveyor, front_mm: float, now: Nanos) -> Act:
    spec = conveyor.spec
    if isinstance(front_mm, bool) or not isinstance(front_mm, int | float) or not 0 <= front_mm <= spec.length:
        raise Misuse(BEYOND_END(front=repr(front_mm), length=spec.length, belt=spec.name))
    front = conveyor.belt.to_grid(front_mm)
    if not conveyor.room_at(front, now):
        raise Refusal(NO_ROOM(on=spec.name))
    return Act(conveyor.block.scheduler, partial(conveyor.put_new, front))


def remove(model: Model, name: str) -> Act:
    """Take a workpiece out of the world. Raises `Misuse` for a name that none can have, `Refusal` where it is not there now."""
    there, sources = dict(_all(model.objects)), _sources(model)
    if isinstance(name, str) and name in there:
        return there[name]
    source, _, number = name.rpartition(".") if isinstance(name, str) else ("", "", "")
    if not source or not number.isdecimal():
        raise Misuse(NO_WORKPIECE_NAME(name=repr(name), example=f"{next(iter(sources), 'infeed')}.3"))
    if source not in sources:
        raise model.unknown(A_CONVEYOR_OR_NEST(), source, sources)
    raise Refusal(NO_WORKPIECE(workpiece=name))


def _sources(model: Model) -> list[str]:
    """Names of all that workpieces come from."""
    return [*model.objects.built(CONVEYOR), *model.objects.built(NEST)]


def _all(objects: BuiltObjects) -> Iterator[tuple[str, Act]]:
    """How to take each workpiece, by its name."""
    for conveyor in objects.built(CONVEYOR).values():
        for placed in conveyor.belt.workpieces:
            yield placed.workpiece.name, Act(conveyor.block.scheduler, partial(_off, conveyor, placed))
    for carrier in (*objects.built(VACUUM).values(), *objects.built(GRIPPER).values()):
        if isinstance(carrier.grip, BeltGrip) and carrier.grip.workpiece is not None:
            yield carrier.grip.workpiece.name, Act(carrier.block.scheduler, carrier.grip.lose)
    for holder in objects.workpieces.holders:
        for name in holder.bodies():
            yield name, Act(holder.scheduler, partial(holder.take, name))


def _off(conveyor: Conveyor, placed: Placed, now: Nanos) -> None:
    conveyor.remove(conveyor.belt, placed)
