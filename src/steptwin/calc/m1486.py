"""Moves of an M1486: from S with A, from P on parabolic, to V; deceleration is the mirror image (M-6 to M-8).

Speeds are the numbers that commands take, in full steps/s; a type for 24 MHz makes twice as many of them, and four times the
acceleration. Distances are minimum microsteps, full step/64.
"""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.calc.contract import (
    ACCELERATION,
    DISTANCE,
    KNEE,
    MICROSTEP,
    QUALIFICATION,
    START,
    VELOCITY,
    Formula,
    MoveQuantity,
)
from steptwin.calc.units import Dimension
from steptwin.datasheet import Limits
from steptwin.errors import Misuse
from steptwin.m1486.commands import PROFILE_RANGE, rows
from steptwin.m1486.drive import speed_curve
from steptwin.m1486.lines import TWO_DACS, Interface
from steptwin.m1486.microsteps import (
    DEFAULT_PROFILE,
    FULL_STEP,
    HIGHEST_SPEED,
    PAIRS,
    low_range_limit,
    microstep_size,
)
from steptwin.m1486.variants import DEFAULT, Variant
from steptwin.messages import Message, MessageText
from steptwin.motion import Profile
from steptwin.motion.ramps import plan_distance

STEEPEST = 65
"""M-4: of A in relation to S; beyond it the manual's table, which is missing, decides."""


VELOCITY_IS_LIMITED = Message(
    "calc.velocity-is-limited", "Q{qualification:g} permits {highest} step/s: V{velocity:g} runs as V{highest} (M-34)"
)
NO_RAMP = Message("calc.no-ramp", "V is not above S: constant velocity, no ramp (M-8)")
PROFILE_OUT_OF_RANGE = Message(
    "calc.profile-out-of-range", "P{profile:g}: the manual permits {low} to {high} step/s, or more than V"
)
STEEP = Message("calc.steep", "A is more than {most} × S: check the table of the manual whether S{start:g} permits it (M-4)")
MICROSTEPS_OF_Q = Message("calc.microsteps-of-q", "above {limit:g} step/s the microsteps are those of Q")
FAST_CLOCK = Message(
    "calc.fast-clock", "at 24 MHz speeds are {speeds} ×, accelerations {accelerations} × the numbers of the commands"
)
LINEAR_RAMP = Message("calc.linear-ramp", "linear ramp")
PARABOLIC_RAMP = Message("calc.parabolic-ramp", "parabolic ramp")
CONSTANT_VELOCITY = Message("calc.constant-velocity", "constant velocity")
SHORT_MOVE = Message("calc.short-move", "short move")
RAMPS_MEET = Message("calc.ramps-meet", "the ramps meet where the braking distance is what remains")
MICROSTEPS_AND_QUALIFICATION = Message(
    "calc.microsteps-and-qualification",
    "M{microstep} does not permit Q{qualification}: permitted is {permitted}",
)


class M1486Model:
    """A type of the family."""

    def __init__(self, variant: Variant = DEFAULT, interface: Interface = TWO_DACS) -> None:
        """``interface``: what its pins choose; M depends on it where none is given."""
        self._clock = variant.clock
        self.title = variant.title
        speed = float(FULL_STEP * variant.clock)

        def quantity(
            name: str, letter: str, meaning: str, dimension: Dimension, pulses: float, default: float | None, source: str
        ) -> MoveQuantity:
            (spec,) = (row for row in rows(letter) if row.section.startswith(("VII.2", "VII.4")) and row.values)
            permitted = spec.permitted(variant)
            is_range = isinstance(permitted, range)
            return MoveQuantity(
                name=name, meaning=meaning, dimension=dimension, unit=spec.unit,
                pulses=pulses, limits=Limits(permitted[0], permitted[-1]), choices=() if is_range else tuple(permitted),
                default=default, code=letter, back="B" if letter == "F" else "", detail="" if letter == "F" else letter,
                source=source,
            )  # fmt: skip

        self.quantities = (
            quantity(DISTANCE, "F", "Distance", Dimension.DISTANCE, 1.0, None, "VII.2"),
            quantity(START, "S", "Start/stop velocity", Dimension.SPEED, speed, variant.start_stop, "VII.2, M-3"),
            quantity(VELOCITY, "V", "Velocity", Dimension.SPEED, speed, None, "VII.2"),
            quantity(ACCELERATION, "A", "Acceleration", Dimension.ACCELERATION, speed * variant.clock, None, "VII.2"),
            quantity(KNEE, "P", "Profile point", Dimension.SPEED, speed, DEFAULT_PROFILE, "VII.2, M-6"),
            quantity(
                MICROSTEP, "M", "Microsteps in a full step at low speed", Dimension.DISTANCE, 1.0, interface.microstep, "VII.4"
            ),
            quantity(QUALIFICATION, "Q", "Microsteps in a full step at high speed", Dimension.DISTANCE, 1.0, 1, "VII.4"),
        )

    def plan(self, values: Mapping[str, float]) -> Profile:
        settings = values[START], values[ACCELERATION], values[KNEE], values[VELOCITY]
        return plan_distance(0, 0, values[DISTANCE], speed_curve(settings, int(values[QUALIFICATION]), self._clock))

    def settable(self, name: str, value: float, values: Mapping[str, float]) -> float:
        """Whole numbers; distances are multiples of a microstep of M."""
        if name != DISTANCE:
            return float(round(value))
        grid = microstep_size(int(values[MICROSTEP]))
        return float(round(value / grid) * grid)

    def check(self, values: Mapping[str, float]) -> None:
        microstep, qualification = int(values[MICROSTEP]), int(values[QUALIFICATION])
        if qualification not in PAIRS[microstep]:
            permitted = ", ".join(f"Q{one}" for one in PAIRS[microstep])
            raise Misuse(MICROSTEPS_AND_QUALIFICATION(microstep=microstep, qualification=qualification, permitted=permitted))

    def notes(self, values: Mapping[str, float], profile: Profile) -> list[MessageText]:
        start, top, knee, qualification = (values[name] for name in (START, VELOCITY, KNEE, QUALIFICATION))
        highest = HIGHEST_SPEED[int(qualification)]
        found = []
        if top > highest:
            found.append(VELOCITY_IS_LIMITED(qualification=qualification, highest=highest, velocity=top))
        if top <= start:
            found.append(NO_RAMP())
        if PROFILE_RANGE.stop <= knee <= top:
            found.append(PROFILE_OUT_OF_RANGE(profile=knee, low=PROFILE_RANGE[0], high=PROFILE_RANGE[-1]))
        if values[ACCELERATION] > STEEPEST * start:
            found.append(STEEP(most=STEEPEST, start=start))
        if top > (limit := low_range_limit(int(values[MICROSTEP]))):
            found.append(MICROSTEPS_OF_Q(limit=limit))
        if self._clock > 1:
            found.append(FAST_CLOCK(speeds=self._clock, accelerations=self._clock**2))
        return found

    def formulas(self, values: Mapping[str, float], profile: Profile) -> list[Formula]:
        found = []
        shapes = {(segment.c2 != 0.0, segment.c3 != 0.0) for segment in profile.segments}
        if (True, False) in shapes:
            found.append(Formula(LINEAR_RAMP(), "v = S + A·t, t = (min(P, V) − S)/A", "VII.2"))
        if (True, True) in shapes:
            found.append(Formula(PARABOLIC_RAMP(), "v = P + A·t − A²·t²/(4·(V − P)), t = 2·(V − P)/A", "M-6"))
        if (False, False) in shapes:
            found.append(Formula(CONSTANT_VELOCITY(), "t = (s − s of the ramps)/v", "VII.2"))
        else:
            found.append(Formula(SHORT_MOVE(), RAMPS_MEET(), "M-7"))
        return found
