"""Drivers for M1486 chips and their twins.

``with M1486("/dev/ttyUSB0") as chip:`` for threads, ``async with AsyncM1486("tcp://host:5022") as chip:`` for asyncio;
several chips share an `M1486Line` or `AsyncM1486Line`. Errors as of `steptwin.drivers`; further subclasses are listed here.
"""

from __future__ import annotations

from steptwin.drivers.m1486.driver import AsyncM1486, ChipStatus
from steptwin.drivers.m1486.failures import (
    Busy,
    DoubtfulMove,
    FileGivenUp,
    Garbled,
    NoEcho,
    NoRoom,
    PositionUnknown,
    ProgramLost,
    Restarted,
    SeveralChips,
    WrongType,
)
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.lines import AsyncM1486Line
from steptwin.drivers.m1486.motion import ChipMoveEnd, ChipMoveFailed, ChipReason
from steptwin.drivers.m1486.settings import ChipSettings
from steptwin.drivers.m1486.sync import M1486, M1486Jog, M1486Line

__all__ = [
    "M1486",
    "AsyncM1486",
    "AsyncM1486Jog",
    "AsyncM1486Line",
    "Busy",
    "ChipMoveEnd",
    "ChipMoveFailed",
    "ChipReason",
    "ChipSettings",
    "ChipStatus",
    "DoubtfulMove",
    "FileGivenUp",
    "Garbled",
    "M1486Jog",
    "M1486Line",
    "NoEcho",
    "NoRoom",
    "PositionUnknown",
    "ProgramLost",
    "Restarted",
    "SeveralChips",
    "WrongType",
]
