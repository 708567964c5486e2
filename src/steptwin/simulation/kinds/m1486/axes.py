"""How an M1486 counts positions: in minimum microsteps, 64 in a full step whatever M and Q are (chapter VII.2, Forward)."""

from __future__ import annotations

from steptwin.errors import Misuse
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.simulation.mechanics.scale import FULL_STEPS


def motor(per_rev: int | None, full_steps: int | None) -> tuple[int, int]:
    """Minimum microsteps and full steps per revolution: each follows from the other."""
    if per_rev is None:
        full_steps = FULL_STEPS if full_steps is None else full_steps
        return full_steps * FULL_STEP, full_steps
    if per_rev % FULL_STEP or (full_steps is not None and per_rev != full_steps * FULL_STEP):
        wanted = f"{FULL_STEP} for each full step"
        motor = "" if full_steps is None else f"; full_steps = {full_steps}: {full_steps * FULL_STEP}"
        raise Misuse(f"pulses_per_rev = {per_rev}: of an M1486 they are minimum microsteps, {wanted}{motor}")
    return per_rev, per_rev // FULL_STEP
