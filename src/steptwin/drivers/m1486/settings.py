"""The settings made by the driver, which cannot be read back, and the duration of motions with them.

Speeds in full steps/s, accelerations in full steps/s², distances in minimum microsteps (full step/64), as the arguments of the
commands; at 24 MHz the motor turns twice as fast with the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.m1486.commands import TABLE, find, range_text, rows
from steptwin.m1486.commanduse import Setting
from steptwin.m1486.flow import defaults
from steptwin.m1486.lines import Interface
from steptwin.m1486.microsteps import FULL_STEP, HIGHEST_SPEED, PAIRS, microstep_size
from steptwin.m1486.variants import Variant
from steptwin.messages import Message
from steptwin.motion.ramps import SpeedCurve, longest_within, plan_distance

COMMANDS = {
    setting.value: spec.key.lower()
    for setting in Setting
    for spec in TABLE
    if spec.use.sets is setting and setting is not Setting.VARIABLE
}
"""The command of each setting."""


MICROSTEPS_AND_QUALIFICATION = Message(
    "drivers.m1486.microsteps-and-qualification", "M{m} does not permit Q{q}: permitted are {names}"
)


@dataclass(frozen=True, slots=True)
class ChipSettings:
    """The settings of a chip; None: unknown."""

    start_stop: int | None = None
    acceleration: int | None = None
    velocity: int | None = None
    profile: int | None = None
    microstep: int | None = None
    qualification: int | None = None
    waveform: int | None = None

    def with_(self, **changes: int | None) -> ChipSettings:
        return replace(self, **changes)

    @property
    def grid_u(self) -> int:
        """Every distance and position has to be a multiple of this; a full step where M is not known."""
        return FULL_STEP if self.microstep is None else microstep_size(self.microstep)

    def check(self) -> None:
        """Raises `Misuse` for an M and Q that do not go together: a move would not start (M-11)."""
        m, q = self.microstep, self.qualification
        if m is not None and q is not None and q not in PAIRS[m]:
            raise Misuse(MICROSTEPS_AND_QUALIFICATION(m=m, q=q, names=[f"Q{n}" for n in PAIRS[m]]))

    def travel_s(self, distance_u: int, variant: Variant) -> float | None:
        """The duration of a move, s; None if a setting is unknown."""
        curve = self._curve(variant)
        return None if curve is None else (plan_distance(0, 0, distance_u, curve).end or 0) / SECOND

    def longest_u(self, duration: Nanos, variant: Variant, interface: Interface) -> int:
        """The longest distance of a move that is over within ``duration``, in minimum microsteps; one microstep at least.
        Settings that are unknown are taken as those of power-up."""
        known = {name: value for name in COMMANDS if (value := getattr(self, name)) is not None}
        curve = replace(after_reset(variant, interface), **known)._curve(variant)
        return self.grid_u if curve is None else longest_within(duration, self.grid_u, curve)

    def _curve(self, variant: Variant) -> SpeedCurve | None:
        """None if a setting is unknown."""
        s, a, v, p, q = self.start_stop, self.acceleration, self.velocity, self.profile, self.qualification
        if s is None or a is None or v is None or p is None or q is None:
            return None
        speed = float(FULL_STEP * variant.clock)
        return SpeedCurve(s * speed, a * speed * variant.clock, p * speed, min(v, HIGHEST_SPEED[q]) * speed)


def after_reset(variant: Variant, interface: Interface) -> ChipSettings:
    """The settings after power-up and ``\\`` (M-3)."""
    state = defaults(variant, interface)
    return ChipSettings(
        state.start_stop, state.acceleration, state.velocity, state.profile, state.microstep, state.qualification, 1
    )


def checked_number(letter: str, number: float, variant: Variant, what: str) -> int:
    """``number``, if the command accepts it. Raises `Misuse` with the permitted range."""
    key = letter.upper()
    if not isfinite(number) or number != int(number) or find(key, int(number), variant) is None:
        (spec,) = rows(key)
        doubled = f", which it doubles ({variant.clock * 12} MHz)" if variant.clock > 1 and spec.unit == "step/s" else ""
        raise Misuse(f"{what} = {number:.15g}: {variant.title} takes {range_text(spec, variant, named=False)}{doubled}")
    return int(number)
