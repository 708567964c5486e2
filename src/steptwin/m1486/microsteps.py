"""Microsteps: which divisions go together and how fast each may run (manual chapter VII.4).

Distances in minimum microsteps (full step / 64), speeds in full steps/s as the arguments of ``V`` give them: at 24 MHz the
motor turns twice as fast with the same argument, and the limits double with it.
"""

from __future__ import annotations

FULL_STEP = 64
"""Minimum microsteps in a full step, and their symbol as a unit."""
UNIT = "min. microsteps"

DEFAULT_DISTANCE_U = 64_000
"""Settings at power-on: the distance is that of F and B (chapter VII.2, Backward)."""
DEFAULT_VELOCITY = 1_000
DEFAULT_PROFILE = 25_000

PAIRS: dict[int, tuple[int, ...]] = {
    1: (1,),
    2: (2,),
    4: (1, 4),
    8: (1, 2),
    16: (4,),
    32: (1, 2, 4),
    64: (1, 2, 4),
}
"""Values of Q that may stand with each M. M1 Q1 is missing in the manual's list and is its default for Step & Direction."""

HIGHEST_SPEED = {1: 20_000, 2: 6_000, 4: 3_000}
"""Highest speed with each Q; with Q1 the largest V."""

MICROSTEPS = tuple(PAIRS)
QUALIFICATIONS = tuple(HIGHEST_SPEED)


def microstep_size(microstep: int) -> int:
    """Minimum microsteps in one microstep of division ``microstep``: what every distance must be a multiple of."""
    return FULL_STEP // microstep


def low_range_limit(microstep: int) -> float:
    """Speed up to which division ``microstep`` is in force; above it the division is Q."""
    return 12_000 / microstep
