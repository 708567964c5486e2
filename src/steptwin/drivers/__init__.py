"""Drivers for the real devices and their twins.

``with Mic488("/dev/ttyUSB0") as mic:`` for threads, ``async with AsyncMic488("tcp://host:502") as mic:`` for asyncio.
The M1486 has the same in `steptwin.drivers.m1486`.
Errors are `steptwin.errors.Misuse`, `Refusal` and `LineFailure`; what is listed here are their kinds.
"""

from __future__ import annotations

from steptwin.drivers.exchange import LineLost, NoAnswer, Overtaken, SentLate, TooLate
from steptwin.drivers.mic488.axis import AsyncAxis
from steptwin.drivers.mic488.driver import AsyncMic488, Mic488Status, load_config
from steptwin.drivers.mic488.failures import MoveFailed, NoMic488, NotReady, Refused, Untold
from steptwin.drivers.mic488.jog import AsyncJog
from steptwin.drivers.mic488.lines import AsyncModbusLine
from steptwin.drivers.mic488.motion import MoveEnd, Reason
from steptwin.drivers.mic488.program import AsyncProgram, ProgramState
from steptwin.drivers.mic488.snapshot import Change, Snapshot
from steptwin.drivers.mic488.sync import Axis, Jog, Mic488, ModbusLine, Program, UserRegisters, UserView
from steptwin.drivers.mic488.user import AsyncUserRegisters, AsyncUserView

__all__ = [
    "AsyncAxis",
    "AsyncJog",
    "AsyncMic488",
    "AsyncModbusLine",
    "AsyncProgram",
    "AsyncUserRegisters",
    "AsyncUserView",
    "Axis",
    "Change",
    "Jog",
    "LineLost",
    "Mic488",
    "Mic488Status",
    "ModbusLine",
    "MoveEnd",
    "MoveFailed",
    "NoAnswer",
    "NoMic488",
    "NotReady",
    "Overtaken",
    "Program",
    "ProgramState",
    "Reason",
    "Refused",
    "SentLate",
    "Snapshot",
    "TooLate",
    "Untold",
    "UserRegisters",
    "UserView",
    "load_config",
]
