"""Status codes (manual 4.1, 4.7, 4.8)."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType

from steptwin.datasheet import Condition


class AxisStatus(enum.IntEnum):
    """Mx_STATUS; 7 is not used."""

    OFF = 0
    ON = 1
    VELOCITY = 2
    POSITION = 3
    REACHED = 4
    ERROR = 5
    HOMING = 6
    CORRECTION = 8
    LIMIT_L = 9
    LIMIT_R = 10


class ControllerStatus(enum.IntEnum):
    """M_STATUS (firmware 1.70)."""

    OK = 0
    POSITION_ERROR = 1
    PROGRAM_ERROR = 2
    MASTER_ERROR = 3


class ProgramState(enum.IntEnum):
    """PROGRAM_CTRL as read (MIC-22); the same numbers written are commands."""

    STOPPED = 0
    RUNNING = 1
    PAUSED = 2


LIMIT = {-1: AxisStatus.LIMIT_L, 1: AxisStatus.LIMIT_R}
"""Status of an axis stopped at a limit while moving in a direction."""

AXIS_CONDITIONS: Mapping[int, Condition] = MappingProxyType(
    {
        AxisStatus.OFF: Condition.OFF,
        AxisStatus.ON: Condition.REST,
        AxisStatus.VELOCITY: Condition.MOVING,
        AxisStatus.POSITION: Condition.MOVING,
        AxisStatus.REACHED: Condition.REST,
        AxisStatus.ERROR: Condition.ERROR,
        AxisStatus.HOMING: Condition.MOVING,
        AxisStatus.CORRECTION: Condition.MOVING,
        AxisStatus.LIMIT_L: Condition.WARNING,
        AxisStatus.LIMIT_R: Condition.WARNING,
    }
)
CONTROLLER_CONDITIONS: Mapping[int, Condition] = MappingProxyType(
    {
        ControllerStatus.OK: Condition.REST,
        ControllerStatus.POSITION_ERROR: Condition.ERROR,
        ControllerStatus.PROGRAM_ERROR: Condition.ERROR,
        ControllerStatus.MASTER_ERROR: Condition.ERROR,
    }
)
