"""``[[collision]]``: where parts of a machine touch: bodies in space, or a condition over signals. It is reported, or jams."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import combinations, product
from typing import Any

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import AXIS
from steptwin.simulation.components.body import BODY, body_of
from steptwin.simulation.components.bodycontact import BodyContact
from steptwin.simulation.components.carriage import CARRIAGE
from steptwin.simulation.components.carriedcontact import CarriedContact
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.follower import FOLLOWER
from steptwin.simulation.components.frames import bodies_on, sources_of
from steptwin.simulation.components.gantry import GANTRY
from steptwin.simulation.components.grasp import Grasp
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.mount import Movement
from steptwin.simulation.components.probe import Probe
from steptwin.simulation.components.quantity import TIME, check_condition, condition_of, owners_of
from steptwin.simulation.components.resting import resting_of
from steptwin.simulation.components.shaft import SHAFT
from steptwin.simulation.components.tool import TOOL
from steptwin.simulation.components.touch import HIT, JAM, REPORT, RESET, Contact, Touch
from steptwin.simulation.components.workpieces import WORKPIECES
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.contacts import Pair
from steptwin.simulation.space.sweeps import SweptBody
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, flag, name_value, naming_in_space, text_value, word


@naming_in_space("list of at least two names", (WORKPIECES,))
def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) < 2:
        raise Misuse(f"{value!r}: expected a list of at least two names")
    return tuple(map(name_value, value))


@naming_in_space("list of pairs of names, such as [['cup', 'table']]")
def _pairs(value: Any) -> tuple[tuple[str, str], ...]:
    if not isinstance(value, list) or not all(isinstance(one, list) and len(one) == 2 for one in value):
        raise Misuse(f"{value!r}: expected a list of pairs of names")
    return tuple((name_value(one), name_value(other)) for one, other in value)


@table("[[collision]]")
class CollisionSpec(TerminalComponentSpec):
    when: str | None = key(
        text_value, "the condition under which parts touch, such as 'x.position > 300 and z.position < 50'", default=None
    )
    between: tuple[str, ...] = key(
        _names,
        f"bodies, elements with the bodies on them, a cup or jaws with what they carry, or '{WORKPIECES}': one touches another",
        default=(),
        excludes=("when",),
    )
    all: bool = key(flag, "whether all bodies touch each other", default=False, excludes=("when", "between"))
    apart_from: tuple[tuple[str, str], ...] = key(
        _pairs, "pairs of names, as in between, that are not compared", default=(), name="except", excludes=("when",)
    )
    effect: str = key(word(REPORT, JAM), "report, or jam: what moves the parts that touch stands", default=REPORT)
    reset: Terminal | None = key(OUTPUT_PIN, "output connected to RESET, which frees what is jammed", default=None)

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(RESET,), outputs=(HIT,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.reset is not None:
            yield Joint("reset", RESET, self.reset)

    @property
    def owners(self) -> tuple[str, ...]:
        """Controllers and elements whose signals are in the condition."""
        return () if self.when is None else owners_of(self.when)

    def others(self, described: ElementSpecs) -> Iterator[tuple[str, str]]:
        yield from (("when", owner) for owner in self.owners if owner != TIME)
        for wanted in self.between:
            yield from (("between", name) for name in (described.holders if wanted == WORKPIECES else (wanted,)))
        if self.all:
            yield from (("all", body.name) for body in described.of(BODY))
        yield from (("except", name) for pair in self.apart_from for name in pair)

    def check(self, text: TomlText) -> None:
        if self.when is not None:
            check_condition(text, self.path, self.name, self.when)
        elif not self.between and not self.all:
            text.wrong(self.path, "D007", "a collision needs one of when, between and all")


AXES_TOUCH = Message("simulation.axes-touch", "{zone}: {axes} touch")
PARTS_TOUCH = Message("simulation.parts-touch", "{zone}: parts touch")
BODIES_TOUCH = Message("simulation.bodies-touch", "{zone}: {one} and {other} touch")


def _make(spec: CollisionSpec, context: ElementContext) -> Touch:
    block, jams = context.terminal_block(spec.name), spec.effect == JAM
    if spec.when is None:
        bodies = _Bodies(spec, context)
        return Touch(block, jams, bodies.contacts, bodies.depends_on)
    axes = dict(_axes_of(spec, context))
    text = partial(AXES_TOUCH, zone=spec.name, axes=" and ".join(axes)) if axes else partial(PARTS_TOUCH, zone=spec.name)
    blocks = tuple(mechanism.block for mechanism in axes.values())
    return Touch(block, jams, [Contact(condition_of(spec.when, block, context), blocks, text)])


class _Bodies:
    """The bodies of a collision, in the order of the description. Raises `Misuse` where they do not fit."""

    def __init__(self, spec: CollisionSpec, context: ElementContext) -> None:
        self._spec = spec
        self._context = context
        self._described = {one.name: one for one in context.objects.described.of(BODY)}
        self._bodies = {name: body_of(one, context.frames) for name, one in self._described.items()}
        self._swept = {name: SweptBody(body) for name, body in self._bodies.items()}
        self._moved: list[Movement] = []
        grasps = (holder for holder in context.objects.workpieces.holders if isinstance(holder, Grasp))
        self._grasps = {grasp.name: grasp for grasp in grasps if grasp.name in spec.between}
        """Cups and jaws, with what they carry."""
        self._named = [name for name in spec.between if name != WORKPIECES and name not in self._grasps]
        bodies = (self._contact(*pair) for pair in self._pairs())
        self.contacts = (*bodies, *self._with_workpieces(), *self._carried())
        if not self.contacts:
            raise Misuse("nothing moves these bodies against each other")

    @property
    def depends_on(self) -> tuple[str, ...]:
        """Names of what changes whether they touch."""
        owners = (owner for one in self._described.values() for owner in one.owners)
        has_workpieces = self._grasps or WORKPIECES in self._spec.between
        pieces = self._context.objects.workpieces.sources if has_workpieces else ()
        return tuple(dict.fromkeys((self._spec.name, *sources_of(self._moved), *owners, *pieces)))

    def _on(self, name: str) -> list[str]:
        return bodies_on(self._context.frames[name], self._bodies, name)

    def _pairs(self) -> Iterator[tuple[str, str]]:
        spec = self._spec
        named = [self._on(name) for name in self._named]
        groups: Sequence[Sequence[str]] = [[name] for name in self._bodies] if spec.all else named
        those = {frozenset(pair) for one, other in combinations(groups, 2) for pair in product(one, other)}
        those -= {frozenset(pair) for one, other in spec.apart_from for pair in product(self._on(one), self._on(other))}
        for one, other in combinations(self._bodies, 2):
            if frozenset((one, other)) in those and not Pair(self._bodies[one], self._bodies[other]).is_constant:
                yield one, other

    def _with_workpieces(self) -> Iterator[Contact]:
        """Contacts of each body with any workpiece."""
        spec, context = self._spec, self._context
        if WORKPIECES not in spec.between:
            return
        block = context.terminal_block(spec.name)
        resting_of(context, block.scheduler)
        for name in dict.fromkeys(one for wanted in self._named for one in self._on(wanted)):
            body = self._bodies[name]
            moved = context.frames.carrying(body.frame)
            self._moved += moved
            probe = Probe(body, {}, context.objects.workpieces)
            blocks = tuple(dict.fromkeys(drive for movement in moved for drive in movement.blocks))
            yield Contact(probe, blocks, partial(_touching, spec.name, name, probe, block))

    def _carried(self) -> Iterator[Contact]:
        """Contacts of what each cup or gripper carries with the others."""
        spec, context = self._spec, self._context
        block = context.terminal_block(spec.name)
        for grasp in self._grasps.values():
            moved = context.frames.carrying(grasp.frame)
            self._moved += moved
            parts = {name: (self._swept[name], self._whens(name)) for wanted in self._named for name in self._on(wanted)}
            others = WORKPIECES in spec.between or len(self._grasps) > 1
            meeting = CarriedContact(grasp, parts, context.objects.workpieces if others else None)
            blocks = tuple(dict.fromkeys(drive for movement in moved for drive in movement.blocks))
            yield Contact(meeting, blocks, partial(_carrying, spec.name, meeting, block))

    def _whens(self, name: str) -> list[SignalCondition]:
        when = self._described[name].when
        return [] if when is None else [condition_of(when, self._context.terminal_block(self._spec.name), self._context)]

    def _contact(self, one: str, other: str) -> Contact:
        context = self._context
        moved = context.frames.between(self._bodies[one].frame, self._bodies[other].frame)
        self._moved += moved
        block = context.terminal_block(self._spec.name)
        conditions = [*self._whens(one), *self._whens(other)]
        contact = BodyContact(self._swept[one], self._swept[other], conditions)
        if not conditions and not context.memo.is_checked and contact.pair.overlap(block.scheduler.now):
            raise Misuse(f"{one!r} and {other!r} overlap when the world begins")
        blocks = tuple(dict.fromkeys(drive for movement in moved for drive in movement.blocks))
        text = partial(BODIES_TOUCH, zone=self._spec.name, one=one, other=other)
        return Contact(contact, blocks, text)


def _touching(zone: str, body: str, probe: Probe, block: TerminalBlock) -> str:
    return BODIES_TOUCH(zone=zone, one=body, other=", ".join(probe.met(block.scheduler.now)))


def _carrying(zone: str, meeting: CarriedContact, block: TerminalBlock) -> str:
    one, other = meeting.told(block.scheduler.now)
    return BODIES_TOUCH(zone=zone, one=one, other=other)


def _axes_of(spec: CollisionSpec, context: ElementContext) -> Iterator[tuple[str, Mechanism]]:
    """The axes in the condition, and those that move what is in it."""
    objects = context.objects
    moved_by = {
        **objects.built(AXIS),
        **{name: carriage.axis for name, carriage in objects.built(CARRIAGE).items()},
        **{name: shaft.axis for name, shaft in objects.built(SHAFT).items()},
        **{name: follower.shaft.axis for name, follower in objects.built(FOLLOWER).items()},
    }
    moved_by_two = {
        **{name: tool.axes for name, tool in objects.built(TOOL).items()},
        **{name: gantry.ends for name, gantry in objects.built(GANTRY).items()},
    }
    for owner in spec.owners:
        axes = (moved_by[owner],) if owner in moved_by else moved_by_two.get(owner, ())
        yield from ((axis.spec.name, axis.mechanism) for axis in axes)


COLLISION = with_terminals(
    CollisionSpec,
    make=_make,
    signals=lambda collision: {"count": SignalOf((collision.block.source,), lambda now: float(collision.count))},
    faults=STUCK,
)
