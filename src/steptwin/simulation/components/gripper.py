"""``[[gripper]]``: two jaws that close on a workpiece, carry it and put it down, with sensors for opened, closed and held."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from math import floor
from typing import ClassVar, NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.messages import Message
from steptwin.simulation.components.beltgrip import BeltGrip
from steptwin.simulation.components.carrier import HELD, Carrier, CarrierSpec, carrier_signals
from steptwin.simulation.components.element import Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.grasp import Grasp
from steptwin.simulation.components.logic import STUCK, Joint, with_terminals
from steptwin.simulation.components.mount import MoverSpec, to_nm
from steptwin.simulation.components.workpieces import Lie
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.drawing import ROD, Drawing
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.mechanics.travel import Travel
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, number, positive_time

CLOSE, OPENED, CLOSED = "CLOSE", "OPENED", "CLOSED"


@table("[[gripper]]")
class GripperSpec(CarrierSpec, MoverSpec):
    close: Terminal | None = key(
        OUTPUT_PIN,
        "output connected to CLOSE, which closes the jaws while it is on; without it a wire may be",
        default=None,
        order=-1,
    )
    stroke: float = key(number(0.0, above=True), "mm between the open jaws", default=20.0)
    width: float = key(number(0.0), "mm of a workpiece between the jaws", default=10.0, in_space=False)
    close_time: Nanos = key(positive_time, "from open to closed, without a workpiece", default=100 * MILLISECOND)
    open_time: Nanos = key(positive_time, "from closed to open", default=100 * MILLISECOND)
    overlap: float = key(
        number(0.0, 1000.0),
        "in space: mm of a workpiece that are between the jaws, from their tips up",
        default=5.0,
        in_space=True,
        order=2,
    )

    @property
    def moves_others(self) -> bool:
        """Never: its direction is that of its jaws."""
        return False

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(CLOSE, *self.places), outputs=(OPENED, CLOSED, HELD))

    @property
    def own_joint(self) -> Joint | None:
        return None if self.close is None else Joint("close", CLOSE, self.close)

    def check(self, text: TomlText) -> None:
        super().check(text)
        if self.width >= self.stroke:
            message = f"width = {self.width:g} mm is not below stroke = {self.stroke:g} mm: open jaws must go over a workpiece"
            text.wrong((*self.path, "width"), "D007", message)


def _grasp(block: TerminalBlock, spec: GripperSpec, context: ElementContext) -> Grasp:
    probe = Body(
        spec.name, context.frames.base(spec.name), Box((0, 0, 0)), (0, 0, to_nm(spec.overlap) - 1)
    )  # just so much touches
    across = spec.towards().axis

    def centred(lie: Lie, body: Body) -> Lie:
        x, y, z = (0 if axis == across else at for axis, at in enumerate(lie.at))
        return Lie((x, y, z), lie.yaw_q)

    return Grasp(block, context, probe, centred)


TOO_WIDE = Message("simulation.workpiece-is-too-wide", "{jaws}: {workpiece} is too wide")


class Between(NamedTuple):
    """A workpiece in space that is between the jaws while they close."""

    workpiece: str
    at: int | None
    """The place of the jaws at which they come to it. It follows from its width when they began to close, or when it came between
    them. None: they do not come to it, because they are closer already, or never as far apart."""


class Gripper(Carrier):
    """The jaws move at constant speeds. They hold a workpiece that is between them when they come to its width, until they open.
    Without one they close."""

    FIXED: ClassVar[tuple[str, ...]] = ("_at", "_grasp", "_spec")
    __slots__ = (*FIXED, "_between", "_is_narrow", "is_held", "slips", "travel")

    def __init__(self, block: TerminalBlock, spec: GripperSpec, context: ElementContext) -> None:
        self._grasp = _grasp(block, spec, context) if spec.is_mounted else None
        super().__init__(block, self._grasp or BeltGrip(block, spec, context))
        self._spec = spec
        self.travel = Travel(spec.close_time, spec.open_time, is_forth=False, now=block.scheduler.now)
        self._at = self._closed_at(exact_fraction(spec.width))
        """The place of the jaws at a workpiece, without a place in space."""
        self._is_narrow = False
        """Without a place in space: whether the jaws are closer than a workpiece is wide, or hold one."""
        self._between: Between | None = None
        self.is_held = False
        self.slips = False
        """Fault: the jaws hold nothing."""

    def _closed_at(self, width: Fraction) -> int:
        """The place of the jaws, this far apart in mm."""
        return floor((1 - width / exact_fraction(self._spec.stroke)) * self.travel.full)

    def _comes_to_one(self, now: Nanos) -> bool:
        """Whether the jaws, without a place in space, come to a workpiece."""
        was_narrow, self._is_narrow = self._is_narrow, self.is_held or self.travel.grid_position(now) >= self._at
        return self.block.is_on(CLOSE) and self._is_narrow and not was_narrow and self.is_occupied(now)

    def _comes_to_one_in_space(self, grasp: Grasp, now: Nanos) -> bool:
        between, self._between = self._between, None
        body = grasp.met(now) if self.block.is_on(CLOSE) and not self.is_held else None
        if body is None:
            return False
        position = self.travel.grid_position(now)
        if between is None or between.workpiece != body.name:
            at = self._closed_at(grasp.width_of(body, self._spec.towards(), now))
            if at <= 0:
                grasp.report(TOO_WIDE(jaws=grasp.name, workpiece=body.name), body.name, "too wide")
            self._between = Between(body.name, at if at > position else None)
            return False
        comes = between.at is not None and position >= between.at
        self._between = Between(body.name, None) if comes else between
        return comes

    def update(self, now: Nanos) -> None:
        closes = self.block.is_on(CLOSE)
        comes = self._comes_to_one(now) if self._grasp is None else self._comes_to_one_in_space(self._grasp, now)
        has_lost = self.is_held and self._grasp is not None and not self.is_occupied(now)
        if self.is_held and (not closes or self.slips or has_lost):
            self.is_held = False
            self.let_go(now)
        elif comes and not self.slips:
            self.is_held = True
            self.take(now)
        direction = 0 if self.is_held else 1 if closes else -1
        if direction != self.travel.direction:
            self.travel.send(direction, now)
            self.block.scheduler.notify(self.block.name)
        position = self.travel.grid_position(now)
        self.block.put(OPENED, float(position == 0))
        self.block.put(CLOSED, float(position == self.travel.full))
        self.block.put(HELD, float(self.is_held))

    def lets_slip(self, now: Nanos) -> bool:
        """Whether the jaws hold nothing although they close on a workpiece."""
        return self.slips and self.block.is_on(CLOSE) and self.is_occupied(now)

    def deadline(self) -> Nanos | None:
        now = self.block.scheduler.now
        place = self._at if self._grasp is None else None if self._between is None else self._between.at
        at = None if self.is_held else place
        moments = (
            *self.travel.turning_points(now),
            None if at is None else self.travel.reaches(at, now, 1),
            None if self._grasp is None or not self.block.is_on(CLOSE) else self.passing(now),
        )
        return min((moment for moment in moments if moment is not None), default=None)

    @property
    def stroke(self) -> float:
        return self._spec.stroke

    def position(self, now: Nanos) -> float:
        """How far the jaws are closed, mm."""
        return self._spec.stroke * (self.travel.grid_position(now) / self.travel.full)


LETS_WORKPIECES_SLIP = Message("simulation.lets-workpieces-slip", "{name} lets workpieces slip")
HOLDS_AGAIN = Message("simulation.holds-again", "{name} holds again")


def _slip(active: ActiveFault, gripper: Gripper, begins: bool, now: Nanos) -> str:
    gripper.slips = begins
    return (LETS_WORKPIECES_SLIP if begins else HOLDS_AGAIN)(name=gripper.block.name)


def _lets_slip(active: ActiveFault, gripper: Gripper, now: Nanos) -> bool:
    return gripper.lets_slip(now)


CLOSED_ON_NOTHING = Message("simulation.closed-on-nothing", "is closed, and holds nothing")


def _stands(gripper: Gripper, now: Nanos) -> Stands | None:
    travel = gripper.travel
    is_empty = gripper.block.is_on(CLOSE) and not gripper.is_held and travel.grid_position(now) == travel.full
    return Stands(CLOSED_ON_NOTHING(), signal=HELD) if is_empty else None


def _signals(gripper: Gripper) -> Mapping[str, SignalOf]:
    source, travel = gripper.block.source, gripper.travel
    bounds = (0.0, gripper.stroke)
    return {
        "position": SignalOf((source,), gripper.position, travel.turning_points, travel.version, unit="mm", bounds=bounds),
        **carrier_signals(gripper),
    }


GRIPPER = with_terminals(
    GripperSpec,
    moves=lambda spec, gripper: (),
    make=lambda spec, context: Gripper(context.terminal_block(spec.name), spec, context),
    signals=_signals,
    stands=_stands,
    drawing=lambda gripper: Drawing(ROD, gripper.stroke, ("position",)),
    faults=(
        *STUCK,
        FaultKind(
            "worn-jaws",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The jaws of a gripper let workpieces slip.",
            effect=ElementEffect(_slip, _lets_slip),
        ),
    ),
)
