"""``[[brake]]``: a brake on the motor of an axis, closed by springs and released by current."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import ClassVar

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import find_axis
from steptwin.simulation.components.element import Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import number
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, NameOf, Terminal, time_value
from steptwin.simulation.toml.values import number as number_value

RELEASE, RELEASED = "RELEASE", "RELEASED"


@table("[[brake]]")
class BrakeSpec(TerminalComponentSpec):
    """``torque`` in N·m at the motor."""

    axis: str = key(NameOf("axis"), "the axis whose motor it holds")
    torque: float = key(number_value(0.0, above=True), "N·m at the motor, of a brake that is not worn")
    release: Terminal | None = key(OUTPUT_PIN, "output connected to RELEASE; without it a wire may be", default=None)
    release_time: Nanos = key(time_value, "from RELEASE on until it lets go", default=30 * MILLISECOND)
    apply_time: Nanos = key(time_value, "from RELEASE off until it acts", default=20 * MILLISECOND)

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(RELEASE,), outputs=(RELEASED,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.release is not None:
            yield Joint("release", RELEASE, self.release)

    def others(self, described: ElementSpecs) -> Iterator[tuple[str, str]]:
        yield "axis", self.axis


class Brake(TerminalComponent):
    """Lets go ``release_time`` after RELEASE is switched on, and acts ``apply_time`` after it is switched off. A shorter pulse
    does not move it."""

    FIXED: ClassVar[tuple[str, ...]] = ("_mechanism", "_spec")
    __slots__ = (*FIXED, "_due", "_is_released", "_was_on", "is_stuck", "share")

    def __init__(self, block: TerminalBlock, spec: BrakeSpec, mechanism: Mechanism) -> None:
        super().__init__(block)
        self._spec = spec
        self._mechanism = mechanism
        self._was_on = False
        self._is_released = False
        self._due: Nanos | None = None
        """When it lets go, or acts."""
        self.is_stuck = False
        """Fault: it does not let go."""
        self.share = 1.0
        """Share of its torque that it has; less while it is worn."""
        if not block.scheduler.is_blank:
            mechanism.brake(spec.torque, block.scheduler.now)

    @property
    def delays(self) -> tuple[Nanos, ...]:
        return self._spec.release_time, self._spec.apply_time

    def acts_on(self, mechanism: Mechanism) -> bool:
        return self._mechanism is mechanism

    def update(self, now: Nanos) -> None:
        self._move(now)  # before the input changes: an input at a moment comes after what is due then
        is_on = self.block.is_on(RELEASE)
        if is_on is not self._was_on:
            self._was_on = is_on
            wait = self._spec.release_time if is_on else self._spec.apply_time
            self._due = None if is_on is self._is_released else now + wait
            self._move(now)
        self.block.put(RELEASED, float(self.is_open))  # before what it leads to
        self._mechanism.brake(0.0 if self.is_open else self._spec.torque * self.share, now)

    @property
    def is_open(self) -> bool:
        return self._is_released and not self.is_stuck

    @property
    def does_not_let_go(self) -> bool:
        """Whether only the fault keeps it closed."""
        return self._is_released and self.is_stuck

    def _move(self, now: Nanos) -> None:
        """Let go or act, if that is due."""
        if self._due is not None and self._due <= now:
            self._due = None
            self._is_released = self._was_on

    def deadline(self) -> Nanos | None:
        return self._due


IS_WORN = Message("simulation.brake-is-worn", "{name} is worn to {share:g} of its torque")
IS_AS_NEW = Message("simulation.brake-is-as-new", "{name} is as new")


def _wear(active: ActiveFault, brake: Brake, begins: bool, now: Nanos) -> str:
    brake.share = active.fault.number("share") if begins else 1.0
    return IS_WORN(name=brake.block.name, share=brake.share) if begins else IS_AS_NEW(name=brake.block.name)


def _brakes(active: ActiveFault, brake: Brake, now: Nanos) -> bool:
    return brake.share < 1.0 and not brake.is_open


DOES_NOT_LET_GO = Message("simulation.does-not-let-go", "{name} does not let go")
LETS_GO_AGAIN = Message("simulation.lets-go-again", "{name} lets go again")


def _stick(active: ActiveFault, brake: Brake, begins: bool, now: Nanos) -> str:
    brake.is_stuck = begins
    return (DOES_NOT_LET_GO if begins else LETS_GO_AGAIN)(name=brake.block.name)


def _is_kept_closed(active: ActiveFault, brake: Brake, now: Nanos) -> bool:
    return brake.does_not_let_go


TO_LET_GO_AND_BRAKES = Message("simulation.to-let-go-and-brakes", "is to let go, and brakes")


def _stands(brake: Brake, now: Nanos) -> Stands | None:
    return Stands(TO_LET_GO_AND_BRAKES()) if brake.does_not_let_go else None


def _make(spec: BrakeSpec, context: ElementContext) -> Brake:
    mechanism = find_axis(spec.axis, context).mechanism
    motor = mechanism.build.motor
    if motor is None or not mechanism.build.coasts_unpowered:
        raise Misuse(f"axis {spec.axis!r} stands without current: a brake needs an [axis.motor] with when_off = 'free'")
    braked = [name for name, other in context.objects.built(BRAKE).items() if other.acts_on(mechanism)]
    if braked:
        raise Misuse(f"axis {spec.axis!r} has the brake {braked[0]!r} already")
    motor.check_coasting(spec.torque)
    return Brake(context.terminal_block(spec.name), spec, mechanism)


BRAKE = with_terminals(
    BrakeSpec,
    make=_make,
    stands=_stands,
    faults=(
        *STUCK,
        FaultKind(
            "worn-brake",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A brake has only a share of its torque.",
            own=(number("share", "Of its torque.", 0.0, 1.0, default=0.2),),
            effect=ElementEffect(_wear, _brakes),
        ),
        FaultKind(
            "stuck-brake",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A brake does not let go.",
            effect=ElementEffect(_stick, _is_kept_closed),
        ),
    ),
)
