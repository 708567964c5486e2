"""Effects of a put to each field of a motor record."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from typing import Protocol

from steptwin.errors import Misuse, Refusal
from steptwin.gateways.epics.motorfields import SET, STATUS_ON
from steptwin.gateways.epics.records import FieldValue, Putter

FIXED = "no command changes the position of the controller"


class PutTarget(Protocol):
    """A motor record (`steptwin.gateways.epics.motorrecord`). Positions are those of the user; all may raise `SteptwinError`."""

    values: dict[str, FieldValue]

    def user(self, dial: float) -> float:
        """The position of the user at one of the dial."""
        ...

    def check_setting(self, who: Putter) -> None: ...

    def set_position(self, user: float) -> None: ...

    def shift(self, offset: float) -> None: ...

    def turn(self, direction: int) -> None: ...

    def limit(self, name: str, value: float) -> None: ...

    async def move(self, who: Putter, user: float) -> None: ...

    async def home(self, who: Putter, button: str) -> None: ...

    async def jog(self, who: Putter, button: str) -> None: ...

    async def end_jog(self, button: str) -> None: ...

    async def stop(self, who: Putter) -> None: ...

    async def pause(self, who: Putter, state: int) -> None: ...

    async def enable(self, who: Putter, *, on: bool) -> None: ...

    async def refresh(self) -> None:
        """Read the controller."""
        ...

    def synchronize(self) -> None: ...

    async def write_ramp(self, who: Putter, velocity: float, seconds: float) -> None: ...


async def put_setting(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    record.check_setting(who)
    record.values[name] = value


async def _put_position(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    number = float(value)
    if name == "RVAL":
        number *= float(record.values["MRES"])
        if math.isnan(number):
            raise Refusal("the step is not known")
    if name == "RLV":
        await _take_position(record, who, float(record.values["VAL"]) + number)
    elif name == "VAL":
        await _take_position(record, who, number)
    elif record.values["SET"] == SET:
        raise Refusal(f"{name} with SET: {FIXED}")
    else:
        await record.move(who, record.user(number))


async def _take_position(record: PutTarget, who: Putter, user: float) -> None:
    """A field in the coordinates of the user is put: move, or with SET change OFF."""
    if record.values["SET"] == SET:
        record.check_setting(who)
        record.set_position(user)
    else:
        await record.move(who, user)


async def _put_tweak(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    if value:
        distance = float(record.values["TWV"]) * (1 if name == "TWF" else -1)
        await _take_position(record, who, float(record.values["VAL"]) + distance)


async def _put_button(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    if name in ("HOMF", "HOMR"):
        if not value:
            raise Misuse(f"{name}: 0: permitted is 1; STOP ends it")
        await record.home(who, name)
    elif value:
        await record.jog(who, name)
    else:
        await record.end_jog(name)


async def _put_stop(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    if value:
        await record.stop(who)


async def _put_spmg(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    await record.pause(who, int(value))


async def _put_ramp(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    velocity, seconds = float(record.values["VELO"]), float(record.values["ACCL"])
    await record.write_ramp(who, *((_within(record, value), seconds) if name == "VELO" else (velocity, float(value))))


async def _put_speed(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    await put_setting(record, who, name, _within(record, value))


def _within(record: PutTarget, value: FieldValue) -> float:
    """A velocity, brought into VBAS to VMAX as ``range_check`` of motorRecord.cc does; VMAX 0: no upper bound."""
    low, high = float(record.values["VBAS"]), float(record.values["VMAX"])
    return min(max(float(value), low), high or math.inf)


async def _put_limit(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    record.check_setting(who)
    record.limit(name, float(value))


async def _put_offset(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    record.check_setting(who)
    record.shift(float(value))


async def _put_direction(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    record.check_setting(who)
    record.turn(int(value))


async def _put_process(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    await record.refresh()


async def _put_status(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    if value == STATUS_ON:
        await record.refresh()


async def _put_sync(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    if value:
        record.check_setting(who)
        record.synchronize()


async def _put_enable(record: PutTarget, who: Putter, name: str, value: FieldValue) -> None:
    await record.enable(who, on=bool(value))


PUTS: dict[str, Callable[[PutTarget, Putter, str, FieldValue], Awaitable[None]]] = {
    **dict.fromkeys(("VAL", "DVAL", "RVAL", "RLV"), _put_position),
    **dict.fromkeys(("TWF", "TWR"), _put_tweak),
    **dict.fromkeys(("JOGF", "JOGR", "HOMF", "HOMR"), _put_button),
    "STOP": _put_stop,
    "SPMG": _put_spmg,
    **dict.fromkeys(("VELO", "ACCL"), _put_ramp),
    **dict.fromkeys(("JVEL", "HVEL"), _put_speed),
    **dict.fromkeys(("HLM", "LLM", "DHLM", "DLLM"), _put_limit),
    "OFF": _put_offset,
    "DIR": _put_direction,
    "CNEN": _put_enable,
    "PROC": _put_process,
    "STUP": _put_status,
    "SYNC": _put_sync,
}
