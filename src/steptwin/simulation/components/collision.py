"""``[[collision]]``: where parts of a machine touch, as a condition over its signals; what touches is reported, or jams."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from steptwin.simulation.components.axis import AXIS
from steptwin.simulation.components.carriage import CARRIAGE
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.follower import FOLLOWER
from steptwin.simulation.components.gantry import GANTRY
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.quantity import TIME, check_condition, condition_of, owners_of
from steptwin.simulation.components.shaft import SHAFT
from steptwin.simulation.components.tool import TOOL
from steptwin.simulation.components.touch import HIT, JAM, REPORT, RESET, Touch
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, text_value, word


@table("[[collision]]")
class CollisionSpec(TerminalComponentSpec):
    when: str = key(text_value, "the condition under which parts touch, such as 'x.position > 300 and z.position < 50'")
    effect: str = key(word(REPORT, JAM), "report, or jam: the axes in the condition, or of what is in it, stand", default=REPORT)
    reset: Terminal | None = key(OUTPUT_PIN, "output connected to RESET, which frees jammed axes", default=None)

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
        return owners_of(self.when)

    def others(self, described: ElementSpecs) -> Iterator[tuple[str, str]]:
        yield from (("when", owner) for owner in self.owners if owner != TIME)

    def check(self, text: TomlText) -> None:
        check_condition(text, self.path, self.name, self.when)


def _make(spec: CollisionSpec, context: ElementContext) -> Touch:
    block = context.terminal_block(spec.name)
    return Touch(block, spec.effect == JAM, condition_of(spec.when, block, context), dict(_axes_of(spec, context)))


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
