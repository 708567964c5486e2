"""``[[body]]``: a box or an upright cylinder that something carries: part of a machine, a table, a hand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.bodytable import BodySpec
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, Reference
from steptwin.simulation.components.pusher import Pusher, pusher_of
from steptwin.simulation.components.signals import Idle, find_signal
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.signal import SignalOf

CAN_ONLY_BE_WATCHED = Message(
    "simulation.presence-can-only-be-watched", "whether a body is there or lit can be watched; conditions say themselves when"
)


class BuiltBody(NamedTuple):
    spec: BodySpec
    objects: BuiltObjects
    pusher: Pusher | None

    def signals(self) -> Mapping[str, SignalOf]:
        """Whether it is there and whether it shines, where that depends on anything; what it pushes."""
        conditions = {"present": self.spec.when, "lit": self.spec.lit}
        watched = {name: self._signal(condition) for name, condition in conditions.items() if condition is not None}
        return watched if self.pusher is None else {**watched, **self.pusher.signals()}

    def _signal(self, text: str) -> SignalOf:
        found: list[SignalOf | Idle] = []

        def signal(name: str) -> SignalOf | Idle:
            found.append(find_signal(self.objects, name))
            return found[-1]

        condition = SignalCondition(text, signal)
        sources = tuple(dict.fromkeys(source for one in found if isinstance(one, SignalOf) for source in one.sources))
        return SignalOf(sources, lambda now: float(condition.holds(now)), check=_refuse)


def _refuse() -> None:
    raise Misuse(CAN_ONLY_BE_WATCHED())


def _refers(spec: BodySpec, described: ElementSpecs) -> Iterator[Reference]:
    """Nothing for one that stands on the floor, and is always there."""
    if spec.on is not None:
        yield Reference(spec.on, spec.on, (*spec.path, "on"))
    owners = [*((owner, "when") for owner in spec.owners), *((owner, "lit") for owner in spec.lit_by)]
    for owner, name in owners:
        yield Reference(spec.on or owners[0][0], owner, (*spec.path, name))
    if spec.pushes and spec.on is not None:
        for name in described.holders:
            yield Reference(spec.on, name, (*spec.path, "pushes"))


def _build(spec: BodySpec, context: ElementContext) -> BuiltBody:
    return BuiltBody(spec, context.objects, pusher_of(spec, context) if spec.pushes else None)


BODY: Element[BodySpec, BuiltBody] = Element(
    spec=BodySpec,
    refers=_refers,
    build=_build,
    signals=BuiltBody.signals,
    moves=lambda spec, body: (),
)
