"""Drivers for the real devices and their twins.

``with Mic488("/dev/ttyUSB0") as mic:`` for threads, ``async with AsyncMic488("tcp://host:502") as mic:`` for asyncio; so are
`M1486` and `AsyncM1486`, whose further classes and errors are in `steptwin.drivers.m1486`. Errors are `steptwin.errors.Misuse`,
`Refusal` and `LineFailure`; their subclasses are listed here.
"""

from __future__ import annotations

from steptwin.drivers.exchange import LineLost, NoAnswer, Overtaken, SentLate, TooLate
from steptwin.drivers.m1486.driver import AsyncM1486
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.lines import AsyncM1486Line
from steptwin.drivers.m1486.sync import M1486, M1486Jog, M1486Line
from steptwin.drivers.mic488.axis import AsyncMic488Axis
from steptwin.drivers.mic488.driver import AsyncMic488, Mic488Status, load_config
from steptwin.drivers.mic488.failures import ModbusRefusal, MoveFailed, NoMic488, NotReady, Unconfirmed
from steptwin.drivers.mic488.jog import AsyncMic488Jog
from steptwin.drivers.mic488.lines import AsyncModbusLine
from steptwin.drivers.mic488.motion import MoveEnd, Reason
from steptwin.drivers.mic488.program import AsyncMic488Program, ProgramState
from steptwin.drivers.mic488.snapshot import Mic488Snapshot, SnapshotChange
from steptwin.drivers.mic488.sync import Mic488, Mic488Axis, Mic488Jog, Mic488Program, ModbusLine, UserRegisters, UserView
from steptwin.drivers.mic488.user import AsyncUserRegisters, AsyncUserView

__all__ = [
    "M1486",
    "AsyncM1486",
    "AsyncM1486Jog",
    "AsyncM1486Line",
    "AsyncMic488",
    "AsyncMic488Axis",
    "AsyncMic488Jog",
    "AsyncMic488Program",
    "AsyncModbusLine",
    "AsyncUserRegisters",
    "AsyncUserView",
    "LineLost",
    "M1486Jog",
    "M1486Line",
    "Mic488",
    "Mic488Axis",
    "Mic488Jog",
    "Mic488Program",
    "Mic488Snapshot",
    "Mic488Status",
    "ModbusLine",
    "ModbusRefusal",
    "MoveEnd",
    "MoveFailed",
    "NoAnswer",
    "NoMic488",
    "NotReady",
    "Overtaken",
    "ProgramState",
    "Reason",
    "SentLate",
    "SnapshotChange",
    "TooLate",
    "Unconfirmed",
    "UserRegisters",
    "UserView",
    "load_config",
]
