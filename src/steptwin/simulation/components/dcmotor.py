"""``[[dcmotor]]``: a DC motor that an output switches on and off, without a controller of its own: it runs up, and it coasts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import ClassVar

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message
from steptwin.simulation.components.driveencoder import Turned, fit_encoders
from steptwin.simulation.components.element import ON_AND_STANDS, Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.logic import STUCK_INPUT, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.components.mount import UPRIGHT, Movement, MoverSpec
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.drawing import DIAL, Drawing
from steptwin.simulation.mechanics.integral import Straight
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.pieces import Motion, gear_of, geared, pieces_of_drive
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, number, time_value

RUN = "RUN"
TURN = 360
STEPS_PER_REV = SECOND
"""Steps of its grid: at one revolution a second it moves one step in a nanosecond."""


@table("[[dcmotor]]")
class DcMotorSpec(TerminalComponentSpec, MoverSpec):
    speed: float = key(number(0.0, above=True), "rev/min of what it turns, under its load, while RUN is on")
    run: Terminal | None = key(OUTPUT_PIN, "output connected to RUN; without it a wire may be", default=None)
    run_up: Nanos = key(time_value, "from rest to speed when RUN is switched on; default at once", default=0)
    coast: Nanos = key(time_value, "from speed to rest when it is switched off; default at once", default=0)

    @property
    def turns_encoders(self) -> bool:
        return True

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(RUN,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.run is not None:
            yield Joint("run", RUN, self.run)


class DcMotor(TerminalComponent):
    """Turns forwards while RUN is on. Its speed rises and falls in straight lines: its driver limits the current, and friction
    alone brakes it."""

    FIXED: ClassVar[tuple[str, ...]] = ("spec",)
    __slots__ = (*FIXED, "drive", "is_dead")

    def __init__(self, block: TerminalBlock, spec: DcMotorSpec) -> None:
        super().__init__(block)
        self.spec = spec
        self.drive = RampedDrive(exact_fraction(spec.speed) / 60, spec.run_up, spec.coast, block.scheduler.now)
        self.is_dead = False
        """Fault: it gets no current."""

    def update(self, now: Nanos) -> None:
        runs = self.block.is_on(RUN) and not self.is_dead
        if runs is not self.drive.runs:
            self.drive.run(runs, now)
            self.block.scheduler.notify(self.block.name)

    def angle(self, now: Nanos) -> float:
        """Degrees, more than 360 after more than a turn."""
        return self.drive.grid_position(now) * TURN / STEPS_PER_REV

    def speed_line(self, now: Nanos) -> Straight:
        """rev/min."""
        speed, slope, until = self.drive.speed(now)
        return Straight(speed * 60, slope * 60, until)

    def speed(self, now: Nanos) -> float:
        """rev/min."""
        return float(self.speed_line(now).value)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        """The end of its present ramp, ns."""
        end = self.drive.straight_from()
        if end > now:
            yield end


# ---------------------------------------------------------------------- the element

GETS_NO_CURRENT = Message("simulation.motor-gets-no-current", "{name} gets no current")
GETS_CURRENT_AGAIN = Message("simulation.motor-gets-current-again", "{name} gets current again")


def _stop(active: ActiveFault, motor: DcMotor, begins: bool, now: Nanos) -> str:
    motor.is_dead = begins
    return (GETS_NO_CURRENT if begins else GETS_CURRENT_AGAIN)(name=motor.block.name)


def _should_run(active: ActiveFault, motor: DcMotor, now: Nanos) -> bool:
    return motor.is_dead and motor.block.is_on(RUN)


def _stands(motor: DcMotor, now: Nanos) -> Stands | None:
    is_on = motor.block.is_on(RUN) and not motor.drive.runs
    return Stands(ON_AND_STANDS(), signal="angle") if is_on and not motor.speed(now) else None


def _make(spec: DcMotorSpec, context: ElementContext) -> DcMotor:
    return DcMotor(context.terminal_block(spec.name), spec)


def _signals(motor: DcMotor) -> Mapping[str, SignalOf]:
    source, version, turning = (motor.block.source,), motor.drive.version, motor.turning_points
    bounds = (0.0, motor.spec.speed)
    return {
        "angle": SignalOf(source, motor.angle, turning, version, "degree"),
        "speed": SignalOf(source, motor.speed, turning, version, "rev/min", bounds, straight=motor.speed_line),
    }


def _moves(spec: DcMotorSpec, motor: DcMotor) -> Sequence[Movement]:
    gear = gear_of(Fraction(4, STEPS_PER_REV))
    motion = Motion(motor.drive.version, lambda now: geared(pieces_of_drive(motor.drive, now), gear))
    return (Movement("angle", motion, spec.towards(UPRIGHT), 1.0, (), (spec.name,), turns=True),)


def _connect(spec: DcMotorSpec, motor: DcMotor, context: ElementContext) -> None:
    fit_encoders(Turned(spec.name, motor.drive, "counts_per_rev", "revolution", Fraction(STEPS_PER_REV)), context)


DCMOTOR = with_terminals(
    DcMotorSpec,
    make=_make,
    connect=_connect,
    signals=_signals,
    drawing=lambda motor: Drawing(DIAL, float(TURN), ("angle",)),
    moves=_moves,
    stands=_stands,
    faults=(
        STUCK_INPUT,
        FaultKind(
            "dead-motor",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A DC motor gets no current although it is switched on: it coasts.",
            effect=ElementEffect(_stop, _should_run),
        ),
    ),
)
