"""``[[beam]]``: a light barrier, a light curtain or a proximity switch, which sees workpieces or parts of the machine."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.components.body import BODY
from steptwin.simulation.components.bodycontact import BodyContact, while_there
from steptwin.simulation.components.bodytable import body_of
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, Reference
from steptwin.simulation.components.frames import bodies_on, check_upright, sources_of
from steptwin.simulation.components.logic import STUCK_OUTPUT, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.mount import UPRIGHT, MoverSpec, direction, to_nm
from steptwin.simulation.components.probe import Probe
from steptwin.simulation.components.quantity import condition_of
from steptwin.simulation.components.resting import resting_of
from steptwin.simulation.components.workpieces import WORKPIECES
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.frames import Direction, Frame
from steptwin.simulation.space.sweeps import SweptBody
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import INPUT_PIN, Terminal, name_value, naming_in_space, number, whole, word
from steptwin.state import Plain

SEEN = "SEEN"


@naming_in_space(f"list of {WORKPIECES} and names of bodies, or of elements that carry some", (WORKPIECES,))
def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not value:
        raise Misuse(f"{value!r}: expected a list of names, or ['{WORKPIECES}']")
    return tuple(map(name_value, value))


@table("[[beam]]")
class BeamSpec(TerminalComponentSpec, MoverSpec):
    """``along``: from its origin. ``count`` beams are ``pitch`` mm apart in the direction ``across``."""

    length: float = key(number(0.0, 100_000.0, above=True), "mm, from its origin to the receiver, or its range")
    count: int = key(whole(1, 1000), "of a light curtain: its beams", default=1)
    pitch: float = key(
        number(0.0, 10_000.0, above=True), "of a light curtain: mm from one beam to the next", default=20.0, needs="count"
    )
    across: Direction = key(
        direction, "of a light curtain: the direction from one beam to the next", default=UPRIGHT, needs="count"
    )
    sees: tuple[str, ...] = key(_names, "workpieces, names of bodies, or of elements with what is on them", default=(WORKPIECES,))
    hysteresis: float = key(number(0.0, 10_000.0), "mm by which its range is longer while it sees something", default=0.0)
    target: Terminal | None = key(INPUT_PIN, "an input that it drives; without it a wire may", default=None, name="to")
    contact: str = key(word("NO", "NC"), "NO (1 while it sees something) or NC (0 then)", default="NO", needs="to")

    @property
    def terminals(self) -> Terminals:
        return Terminals(outputs=(SEEN,))

    @property
    def joints(self) -> Iterable[Joint]:
        return ()

    def others(self, described: ElementSpecs) -> Iterator[tuple[str, str]]:
        for wanted in self.sees:
            yield from (("sees", name) for name in described.carried_by(wanted) if wanted != WORKPIECES)
        if WORKPIECES in self.sees:
            yield from (("sees", name) for name in described.holders)

    def check(self, text: TomlText) -> None:
        if self.along is not None and self.count > 1 and self.along.axis == self.across.axis:
            text.wrong((*self.path, "across"), "D007", f"across = '{self.across}' is along its beams")

    @property
    def moves_others(self) -> bool:
        """Never: its direction is that of its beams."""
        return False

    def segments(self, frame: Frame, more: float = 0.0) -> Iterator[Body]:
        """Its beams, ``more`` mm longer."""
        towards, half = self.towards(), to_nm(self.length + more) // 2
        for n in range(self.count):
            centre, halves = [0, 0, 0], [0, 0, 0]
            centre[towards.axis], halves[towards.axis] = towards.sign * half, half
            centre[self.across.axis] += self.across.sign * to_nm(self.pitch) * n
            (x, y, z), (a, b, c) = centre, halves
            yield Body(self.name, frame, Box((a, b, c)), (x, y, z))


class Beam(TerminalComponent):
    """SEEN is on while anything that it sees is in one of its beams."""

    FIXED: ClassVar[tuple[str, ...]] = ("_depends_on", "_far", "_near", "_reads")
    __slots__ = (*FIXED, "_due", "_sees", "by")

    def __init__(
        self,
        block: TerminalBlock,
        near: Sequence[Probe],
        far: Sequence[Probe],
        depends_on: tuple[str, ...],
        reads: tuple[str, ...],
    ) -> None:
        """``far``: the probes while it sees something."""
        super().__init__(block)
        self._near, self._far = tuple(near), tuple(far)
        self._depends_on, self._reads = depends_on, reads
        self._sees = False
        self.by = ""
        """The part or workpiece that it sees, or saw last."""
        self._due: Nanos | None = None

    @property
    def depends_on(self) -> tuple[str, ...]:
        return self._depends_on

    @property
    def reads(self) -> tuple[str, ...]:
        return self._reads

    def update(self, now: Nanos) -> None:
        there = next((name for probe in (self._far if self._sees else self._near) for name in probe.met(now)), None)
        self._sees, self.by = there is not None, there or self.by
        self.block.put(SEEN, float(self._sees))
        changes = (probe.change(now) for probe in (self._far if self._sees else self._near))
        self._due = min((due for due in changes if due is not None), default=None)

    def deadline(self) -> Nanos | None:
        return self._due

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        for probe in (*self._near, *self._far):
            probe.forget()


def _make(spec: BeamSpec, context: ElementContext) -> Beam:
    block, frames, workpieces = context.terminal_block(spec.name), context.frames, context.objects.workpieces
    if WORKPIECES in spec.sees:
        resting_of(context, block.scheduler)
        check_upright(spec.name, frames.base(spec.name))
    described = {one.name: one for one in context.objects.described.of(BODY)}
    every = {name: body_of(one, frames) for name, one in described.items()}
    seen = [name for wanted in spec.sees if wanted != WORKPIECES for name in bodies_on(frames[wanted], every, wanted)]
    bodies = {name: SweptBody(every[name]) for name in seen}
    frame = frames.base(spec.name)
    pieces = workpieces if WORKPIECES in spec.sees else None

    def probe(segment: Body) -> Probe:
        lasting, swept = {}, SweptBody(segment)
        for name in seen:
            when = described[name].when
            whens = () if when is None else (condition_of(when, block, context),)
            lasting[name] = while_there(BodyContact(swept, bodies[name]), whens)
        return Probe(segment, lasting, pieces)

    moved = [movement for name in seen for movement in frames.between(frame, every[name].frame)]
    owners = tuple(owner for name in seen for owner in described[name].owners)
    sources = (spec.name, *sources_of(moved), *sources_of(frames.carrying(frame)))
    if WORKPIECES in spec.sees:
        sources += workpieces.sources
    near = [*map(probe, spec.segments(frame))]
    far = [*map(probe, spec.segments(frame, spec.hysteresis))] if spec.hysteresis else near
    return Beam(block, near, far, sources, owners)


def _refers(spec: BeamSpec) -> Iterator[Reference]:
    if spec.target is not None:
        yield Reference(spec.name, spec.target[0], (*spec.path, "to"))


def _drive(spec: BeamSpec, beam: Beam, context: ElementContext) -> None:
    if spec.target is not None:
        wire = Wire(PinName(spec.name, SEEN), PinName(*spec.target), spec.contact == "NC")
        context.join(context.memo.once((*spec.path, "to"), lambda: wire), (*spec.path, "to"))


BEAM = with_terminals(
    BeamSpec,
    make=_make,
    refers=_refers,
    fit=_drive,
    faults=(STUCK_OUTPUT,),
    moves=lambda spec, beam: (),
)
