"""Status codes (manual 4.1, 4.7, 4.8)."""

from __future__ import annotations

import enum


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
