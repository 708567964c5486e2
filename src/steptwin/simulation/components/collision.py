"""``[[collision]]``: where parts of a machine touch: bodies in space, or a condition over signals. It is reported, or jams."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import AXIS
from steptwin.simulation.components.body import BODY
from steptwin.simulation.components.carriage import CARRIAGE
from steptwin.simulation.components.compared import Compared
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.follower import FOLLOWER
from steptwin.simulation.components.gantry import GANTRY
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.quantity import TIME, check_condition, condition_of, owners_of
from steptwin.simulation.components.shaft import SHAFT
from steptwin.simulation.components.tool import TOOL
from steptwin.simulation.components.touch import HIT, JAM, REPORT, RESET, Contact, Touch
from steptwin.simulation.components.workpieces import WORKPIECES
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.mechanics import Mechanism
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
            names = described.holders if wanted == WORKPIECES else described.carried_by(wanted)
            yield from (("between", name) for name in names)
        if self.all:
            yield from (("all", body.name) for body in described.of(BODY))
        yield from (("except", name) for pair in self.apart_from for name in pair if name != WORKPIECES)

    def check(self, text: TomlText) -> None:
        if self.when is not None:
            check_condition(text, self.path, self.name, self.when)
        elif not self.between and not self.all:
            text.wrong(self.path, "D007", "a collision needs one of when, between and all")


AXES_TOUCH = Message("simulation.axes-touch", "{zone}: {axes} touch")
PARTS_TOUCH = Message("simulation.parts-touch", "{zone}: parts touch")
NOTHING_JAMS = Message(
    "simulation.nothing-jams", "effect = 'jam': {when!r} names no axis, and nothing that an axis moves, so nothing would stand"
)


def _make(spec: CollisionSpec, context: ElementContext) -> Touch:
    block, jams = context.terminal_block(spec.name), spec.effect == JAM
    if spec.when is None:
        compared = Compared(block, context, spec.between, spec.apart_from, every_body=spec.all, jams=jams)
        return Touch(block, jams, compared.contacts, compared.reads, compared.depends_on)
    axes = dict(_axes_of(spec, context))
    if jams and not axes:
        raise Misuse(NOTHING_JAMS(when=spec.when))
    text = partial(AXES_TOUCH, zone=spec.name, axes=" and ".join(axes)) if axes else partial(PARTS_TOUCH, zone=spec.name)
    blocks = tuple(mechanism.block for mechanism in axes.values())
    return Touch(block, jams, [Contact(condition_of(spec.when, block, context), blocks, text)], spec.owners)


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
