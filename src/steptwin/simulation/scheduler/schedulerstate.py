"""The state of a scheduler as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.scheduler.wires import DelayedLevel, PinName
from steptwin.state import Plain


class SchedulerState(NamedTuple):
    """State of a scheduler, its controllers and its parts."""

    now: Nanos
    controllers: tuple[Any, ...]
    parts: tuple[Plain, ...]
    levels: Mapping[PinName, float]
    delayed: tuple[DelayedLevel, ...]
