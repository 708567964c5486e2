"""Trials that suspend a program at a point of an operation on a MIC488, and see that nothing moves afterwards."""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable
from typing import Any

from host_rig import Wire, async_driver, task_line, thread_line
from mic488_rig import loaded
from suspension import AT_THE_LAST_MOMENT, Suspension

from steptwin.drivers import AsyncMic488
from steptwin.drivers.blocking import finish
from steptwin.errors import SteptwinError
from steptwin.mic488.registers import register_map
from steptwin.mic488.status import ProgramState
from steptwin.mic488.values import moves
from steptwin.wire import pdu

RACE_P = 2
"""Pulses that an axis makes which was started too late and is stopped at once."""
RAMP_DOWN = pdu.WriteRegistersRequest(register_map("1.70").of("VEL_ABS", 1).address, (0, 0))
"""A velocity of 0, which a jog ends with."""
_M_STOP = register_map("1.70").of("M_STOP").address
_PROGRAM_CTRL = register_map("1.70").of("PROGRAM_CTRL").address


async def _jog(mic: AsyncMic488) -> None:
    async with mic.axis(1).jog(5.0) as jog:
        for _ in range(4):
            if not await jog.hold():
                break


async def _move_and_wait(mic: AsyncMic488) -> None:
    await mic.axis(1).move_to(20.0)
    await mic.axis(1).wait()


OPERATIONS: dict[str, Callable[[AsyncMic488], Awaitable[Any]]] = {
    "move_to": lambda mic: mic.axis(1).move_to(20.0),
    "move_by": lambda mic: mic.axis(1).move_by(20.0),
    "move_velocity": lambda mic: mic.axis(1).move_velocity(1.0),
    "home": lambda mic: mic.axis(1).home(-5.0),
    "jog": _jog,
    "jog_bit": lambda mic: mic.axis(1).jog_bit(1, True),
    "move_together": lambda mic: mic.move_together({1: 20.0, 2: 10.0}),
    "move_together_by": lambda mic: mic.move_together_by({1: 20.0, 2: 10.0}),
    "run_together": lambda mic: mic.run_together({1: 1.0, 2: 1.0}),
    "move and wait": _move_and_wait,
    "set a distance": lambda mic: mic.set("M1_POS_REL", 20.0),
    "set a position": lambda mic: mic.set("M1_POS_ABS", 20.0),
    "raw": lambda mic: mic.request(pdu.WriteRegistersRequest(10032, (0, 0x41A0))),
    "program": lambda mic: mic.program.start(),
    "set the program": lambda mic: mic.set("PROGRAM_CTRL", 1),
    "raw start of the program": lambda mic: mic.request(pdu.WriteRegisterRequest(_PROGRAM_CTRL, 1)),
}


def _motions_since(wire: Wire, back: int) -> list[str]:
    """What was sent since then that may move something, and what stops it."""
    registers = register_map("1.70")
    found = []
    for at, frame in wire.sent:
        if at < back:
            continue
        request = pdu.decode_request(frame[1:-2])
        if moves(registers, request) and request != RAMP_DOWN:
            found.append("motion")
        elif isinstance(request, pdu.WriteRegisterRequest) and request.address in (_M_STOP, _PROGRAM_CTRL):
            found.append("stop")
    return found


def trial(name: str, at: int | None, *, tasks: bool, loss: int) -> tuple[int, str]:
    """Do an operation with a suspension at point ``at``: how many points it has, and what was wrong."""
    wire = Wire()
    wire.twin.program.banks.programs[0], _ = loaded("MAIN:\nDELAY 60\nJUMP MAIN\n")
    suspension = Suspension(wire)
    line: Any = suspension.task(task_line(wire)) if tasks else suspension.thread(thread_line(wire))
    mic = async_driver(line, wire)
    stood: dict[int, int] = {}

    def note() -> None:
        stood.update({axis: wire.position(axis) for axis in (1, 2) if not wire.moving(axis)})

    async def work() -> None:
        await mic.open()
        await mic.enable()
        suspension.loss = loss
        suspension.on_back = note
        suspension.arm(at)
        with contextlib.suppress(SteptwinError):
            await OPERATIONS[name](mic)

    if tasks:
        suspension.run(work())
    else:
        finish(work())
    points, back = suspension.count, suspension.back
    if back is None:
        return points, ""
    suspension.at = None
    sent = _motions_since(wire, back)
    wire.rest(100.0)
    wrong = []
    if any(abs(wire.position(axis) - position) > RACE_P for axis, position in stood.items()):
        wrong.append(f"stood at {stood} pulses, then at {[wire.position(axis) for axis in stood]}")
    begun = sent.count("motion")
    if begun and wire.twin.program.state is ProgramState.RUNNING:
        wrong.append("a program runs on")
    if begun and (sent[:2] != ["motion", "stop"] or begun > 1 or suspension.what not in AT_THE_LAST_MOMENT):
        wrong.append(f"sent {sent}")
    return points, f"{name}, suspended {suspension.what} (point {at}): {'; '.join(wrong)}" if wrong else ""
