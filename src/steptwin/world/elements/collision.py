"""``[[collision]]``: where parts of a machine touch, as a condition over its signals; what touches is reported, or jams."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

from steptwin.machine import Nanos
from steptwin.state import Plain
from steptwin.world.board import Board
from steptwin.world.condition import SignalCondition
from steptwin.world.elements.axis import AXIS
from steptwin.world.elements.carriage import CARRIAGE
from steptwin.world.elements.follower import FOLLOWER
from steptwin.world.elements.logic import STUCK, BoardPart, BoardSpec, Joint, with_terminals
from steptwin.world.elements.quantity import TIME, check_condition, condition_of, owners_of
from steptwin.world.elements.shaft import SHAFT
from steptwin.world.elements.tool import TOOL
from steptwin.world.kind import Terminals
from steptwin.world.mechanics import Mechanism
from steptwin.world.reader import Key, TomlText, optional
from steptwin.world.signals import SignalOf
from steptwin.world.site import Site, Terminal
from steptwin.world.spec import WorldSpec
from steptwin.world.values import OUTPUT_PIN, text_value, word

RESET, HIT = "RESET", "HIT"
REPORT, JAM = "report", "jam"


@dataclass(frozen=True, slots=True, kw_only=True)
class CollisionSpec(BoardSpec):
    when: str
    effect: str
    reset: Terminal | None

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(RESET,), outputs=(HIT,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.reset is not None:
            yield Joint("reset", RESET, self.reset)

    @property
    def owners(self) -> tuple[str, ...]:
        """Machines and elements whose signals are in the condition."""
        return owners_of(self.when)

    def others(self, world: WorldSpec) -> Iterator[tuple[str, str]]:
        yield from (("when", owner) for owner in self.owners if owner != TIME)

    def check(self, text: TomlText) -> None:
        check_condition(text, self.path, self.when)


class Touch(BoardPart):
    """The output is on while parts touch. If that jams them, the axes stand from then on; they are free again when RESET is
    switched on, and jam again when they touch the next time."""

    FIXED: ClassVar[tuple[str, ...]] = ("_axes", "_condition", "_jams")
    __slots__ = (*FIXED, "_due", "_is_jammed", "_is_short", "_touches", "_was_reset", "count")

    def __init__(self, board: Board, jams: bool, condition: SignalCondition, axes: Mapping[str, Mechanism]) -> None:
        super().__init__(board)
        self._jams = jams
        self._condition = condition
        self._axes = axes
        self._due: Nanos | None = None
        """When parts may touch, or part, without an event."""
        self._touches = False
        self._is_jammed = False
        self._is_short = False
        """Whether they stand less than a pulse before where they touched: a jammed axis stands at a whole pulse."""
        self._was_reset = False
        self.count = 0
        """How often they touched."""

    @property
    def watches(self) -> None:
        """The condition may be over anything."""

    @property
    def axes(self) -> Iterable[str]:
        """The names of the axes that jam."""
        return self._axes

    def is_moved_by(self, mechanism: Mechanism) -> bool:
        return any(one is mechanism for one in self._axes.values())

    @property
    def output(self) -> str:
        """The terminal that is on while they touch."""
        return HIT

    def touching(self) -> str:
        """What happens when they touch, as text."""
        return f"{self.board.name}: {' and '.join(self._axes) or 'parts'} touch"

    def update(self, now: Nanos) -> None:
        touches = self._condition.holds(now) or self._is_short
        if touches is not self._touches:
            self._touches = touches
            if touches:
                self._touch(now)
            else:
                self._report(f"{self.board.name}: apart again", touches=False)
        is_reset = self.board.is_on(RESET)
        if is_reset and not self._was_reset and self._is_jammed:
            self._block(False, now)
        self._was_reset = is_reset
        self.board.put(self.output, float(touches))
        self._due = self._condition.change(now)

    def _touch(self, now: Nanos) -> None:
        self.count += 1
        self._report(self.touching(), touches=True)
        if self._jams and not self._is_jammed:
            self._block(True, now)
            self._is_short = not self._condition.holds(now)

    def _block(self, blocked: bool, now: Nanos) -> None:
        self._is_jammed, self._is_short = blocked, False
        for mechanism in self._axes.values():
            mechanism.block(blocked, now, by=self.board.name)

    def _report(self, text: str, *, touches: bool) -> None:
        kernel = self.board.kernel
        facts = ("collision", self.board.name), ("touches", touches), ("jams", self._jams)
        kernel.report(kernel.owner(self.board.name), "event", "collision", text, *facts)

    def deadline(self) -> Nanos | None:
        return self._due

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._condition.forget()


def _make(spec: CollisionSpec, site: Site) -> Touch:
    board = site.board(spec.name)
    return Touch(board, spec.effect == JAM, condition_of(spec.when, board, site), dict(_axes_of(spec, site)))


def _axes_of(spec: CollisionSpec, site: Site) -> Iterator[tuple[str, Mechanism]]:
    """The axes in the condition, and those that move what is in it."""
    parts = site.parts
    moved_by = {
        **parts.built(AXIS),
        **{name: carriage.axis for name, carriage in parts.built(CARRIAGE).items()},
        **{name: shaft.axis for name, shaft in parts.built(SHAFT).items()},
        **{name: follower.shaft.axis for name, follower in parts.built(FOLLOWER).items()},
    }
    for owner in spec.owners:
        tool = parts.built(TOOL).get(owner)
        axes = tool.axes if tool is not None else (moved_by[owner],) if owner in moved_by else ()
        yield from ((axis.spec.name, axis.mechanism) for axis in axes)


COLLISION = with_terminals(
    "collision",
    CollisionSpec,
    (
        Key("when", text_value, "the condition under which parts touch, such as 'x.position > 300 and z.position < 50'"),
        optional(word(REPORT, JAM), "effect", "report, or jam: the axes in the condition, or of what is in it, stand", REPORT),
        optional(OUTPUT_PIN, "reset", "output joined to RESET, which frees jammed axes"),
    ),
    make=_make,
    signals=lambda collision: {"count": SignalOf((collision.board.source,), lambda now: float(collision.count))},
    faults=STUCK,
)
