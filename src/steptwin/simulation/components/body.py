"""``[[body]]``: a box or an upright cylinder that something carries: part of a machine, a table, a hand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.bodytable import BodySpec, condition_owners
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, Reference
from steptwin.simulation.components.frames import HAS_NO_PLACE
from steptwin.simulation.components.pusher import Pusher, pusher_of
from steptwin.simulation.components.signals import Idle, find_signal
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.toml.names import Unknown

CAN_ONLY_BE_WATCHED = Message(
    "simulation.presence-can-only-be-watched",
    "whether a body is there, is lit or draws can be watched; conditions say themselves when",
)

SIGNALS = {"when": "present", "lit": "lit", "draws": "draws"}
"""By the keys that say when they are 1."""


class BuiltBody(NamedTuple):
    spec: BodySpec
    objects: BuiltObjects
    pusher: Pusher | None

    def signals(self) -> Mapping[str, SignalOf]:
        """Whether it is there, shines and draws, where that depends on anything; what it pushes."""
        watched = {SIGNALS[key]: self._signal(condition) for key, condition in self.spec.conditions.items()}
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
    owners = [(owner, name) for name, text in spec.conditions.items() for owner in condition_owners(text)]
    for owner, name in owners:
        yield Reference(spec.on or owners[0][0], owner, (*spec.path, name))
    if spec.pushes and spec.on is not None:
        for name in described.holders:
            yield Reference(spec.on, name, (*spec.path, "pushes"))


def _build(spec: BodySpec, context: ElementContext) -> BuiltBody:
    for name in (spec.draws_on, spec.line_to):
        if name is not None and name not in context.objects.frames:
            raise Unknown(name, HAS_NO_PLACE(name=name))
    return BuiltBody(spec, context.objects, pusher_of(spec, context) if spec.pushes else None)


BODY: Element[BodySpec, BuiltBody] = Element(
    spec=BodySpec,
    refers=_refers,
    build=_build,
    signals=BuiltBody.signals,
    moves=lambda spec, body: (),
)
