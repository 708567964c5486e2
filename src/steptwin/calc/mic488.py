"""Moves of a MIC488 in position mode: ACC up, VMAX, DEC down (MIC-29), in its configured unit."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.calc.contract import ACCELERATION, DECELERATION, DISTANCE, VELOCITY, Formula, MoveQuantity
from steptwin.calc.units import Dimension
from steptwin.datasheet import Limits
from steptwin.errors import Misuse
from steptwin.messages import Message, MessageText
from steptwin.mic488.axis import MAX_SPEED_P
from steptwin.mic488.encoding import REAL_MAX
from steptwin.motion import MotionState, Profile, plan_position

FARTHEST_P = 2**32 - 1
"""From one end of the coordinates to the other (MIC-7)."""
AXES = (1, 2, 3, 4)


PULSES = Message("calc.pulses", "{count} pulses, at most {most:.6g} a second")
TOO_SHORT = Message("calc.too-short", "too short to reach the velocity: a triangle")
TRAPEZOID = Message("calc.trapezoid", "trapezoid")
TRIANGLE = Message("calc.triangle", "triangle")
NO_SUCH_AXIS = Message("calc.no-such-axis", "axis {axis}: a MIC488 has {first} to {last}")


class Mic488Model:
    """An axis of a MIC488."""

    title = "MIC488"

    def __init__(self, unit: str = "imp", gear: float = 1.0, axis: int = 1) -> None:
        """``gear``: pulses in a ``unit``. Raises `Misuse` for an axis that is not there."""
        if axis not in AXES:
            raise Misuse(NO_SUCH_AXIS(axis=axis, first=AXES[0], last=AXES[-1]))
        self._gear = gear
        reals = Limits(0.0, REAL_MAX, is_low_excluded=True)
        fastest = Limits(0.0, MAX_SPEED_P / gear, is_low_excluded=True)
        farthest = Limits(0.0, FARTHEST_P / gear, is_low_excluded=True)

        def quantity(
            name: str, meaning: str, dimension: Dimension, limits: Limits, source: str, code: str = "", same_as: str | None = None
        ) -> MoveQuantity:
            register = f"M{axis}_{code}" if code else ""
            suffix = dimension.value
            return MoveQuantity(
                name=name, meaning=meaning, dimension=dimension, unit=f"{unit}{suffix}", pulses=gear, limits=limits,
                code=register, same_as=same_as, source=source,
            )  # fmt: skip

        self.quantities = (
            quantity(DISTANCE, "Distance", Dimension.DISTANCE, farthest, "4.5"),
            quantity(VELOCITY, "Velocity", Dimension.SPEED, fastest, "4.3", "VMAX"),
            quantity(ACCELERATION, "Acceleration", Dimension.ACCELERATION, reals, "4.3", "ACC"),
            quantity(DECELERATION, "Deceleration", Dimension.ACCELERATION, reals, "4.3, MIC-29", "DEC", ACCELERATION),
        )

    def plan(self, values: Mapping[str, float]) -> Profile:
        gear = self._gear
        target, acc, dec, vmax = (values[name] * gear for name in (DISTANCE, ACCELERATION, DECELERATION, VELOCITY))
        return plan_position(MotionState(0, 0, 0.0, 0.0), target, acc, dec, vmax)

    def settable(self, name: str, value: float, values: Mapping[str, float]) -> float:
        """Whole pulses (MIC-14). What a REAL cannot hold, its eighth digit, is left out of account."""
        return round(value * self._gear) / self._gear if name == DISTANCE else value

    def check(self, values: Mapping[str, float]) -> None:
        """All values go together."""

    def notes(self, values: Mapping[str, float], profile: Profile) -> list[MessageText]:
        pulses = round(values[DISTANCE] * self._gear)
        found = [PULSES(count=abs(pulses), most=min(values[VELOCITY] * self._gear, MAX_SPEED_P))]
        if not _has_constant(profile):
            found.append(TOO_SHORT())
        return found

    def formulas(self, values: Mapping[str, float], profile: Profile) -> list[Formula]:
        if _has_constant(profile):
            return [Formula(TRAPEZOID(), "t = v/(2·a) + v/(2·d) + s/v, while v²/(2·a) + v²/(2·d) < s", "4.3, MIC-29")]
        peak = "v = √(2·s·a·d/(a + d)), t = v/a + v/d"
        return [Formula(TRIANGLE(), peak, "4.3, MIC-29")]


def _has_constant(profile: Profile) -> bool:
    return any(segment.c2 == 0.0 for segment in profile.segments)
