"""The table of interrupts: event, label, and the register that enables it."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.controller import MILLISECOND, Nanos

INPUT_LABELS = 31
"""``INT_IN1``…``INT_IN31`` are labels of the language; the controller has twenty inputs."""
INPUTS = 20
INPUTS_WITH_REGISTER = 8
"""Inputs whose interrupt a program can enable; those above only by the configuration (``Int``)."""


@dataclass(frozen=True, slots=True)
class InterruptEvent:
    """``name`` is the label without its prefix (``IN3``), ``register`` the enabling register's name in upper case.

    ``input`` is the number of the input (0 for other events), ``axis`` that of the drive, ``period`` that of a tick.
    """

    name: str
    register: str | None
    since: str | None = None
    input: int = 0
    axis: int = 0
    period: Nanos = 0


def _inputs() -> list[InterruptEvent]:
    numbers = range(1, INPUT_LABELS + 1)
    return [InterruptEvent(f"IN{n}", f"CFGINT_IN{n}" if n <= INPUTS_WITH_REGISTER else None, input=n) for n in numbers]


# WBC-20: the manual of 1.74 has ticks of 10, 100 and 1000 ms but no names for them: TICK is the known one of 10 ms,
# the others carry their period in the name. Drive-state interrupts are switched like MODBUS and TICK (0 off, 4 on).
EVENTS = (
    *_inputs(),
    InterruptEvent("MODBUS", "CFGINT_MODBUS"),
    InterruptEvent("TICK", "CFGINT_TICK", period=10 * MILLISECOND),
    InterruptEvent("TICK100", "CFGINT_TICK100", since="1.70", period=100 * MILLISECOND),
    InterruptEvent("TICK1000", "CFGINT_TICK1000", since="1.70", period=1000 * MILLISECOND),
    *(InterruptEvent(f"M{n}", f"CFGINT_M{n}", since="1.70", axis=n) for n in range(1, 5)),
)

PREFIX = "INT_"
HARD_PREFIX = "HARDINT_"
HARD_SINCE = "1.70"

BY_LABEL: dict[str, tuple[InterruptEvent, bool]] = {
    prefix + event.name: (event, prefix == HARD_PREFIX) for prefix in (PREFIX, HARD_PREFIX) for event in EVENTS
}
"""Event of an interrupt label in upper case, and whether it waits for the end of the statement in progress."""

BY_REGISTER = {event.register: event for event in EVENTS if event.register is not None}
