"""A client of its own process: ophyd-async's `Motor`, and aioca, which says why a put failed. Prints what it finds as JSON.

EPICS_CA_ADDR_LIST of the environment says where the server is; the argument is the name of the record.
"""

import asyncio
import json
import sys
from typing import Any

import aioca
from ophyd_async.core import wait_for_value
from ophyd_async.epics.motor import Motor, MotorLimitsError, UseSetMode

PREFIX = sys.argv[1]
LONGEST_S = 30.0


async def get(field: str) -> float:
    found: Any = await aioca.caget(f"{PREFIX}.{field}")
    return float(found)


async def refused(name: str, value: float) -> bool:
    try:
        await aioca.caput(name, value, wait=True, timeout=20)
    except aioca.CANothing:
        return True
    return False


async def main() -> dict[str, object]:
    found: dict[str, object] = {"while it is off": await refused(PREFIX, 10.0)}
    await aioca.caput(f"{PREFIX}.CNEN", 1, wait=True)
    motor = Motor(PREFIX, name="motor")
    await motor.connect(timeout=20)

    async def position() -> list[float]:
        return [await motor.user_readback.get_value(), await motor.user_setpoint.get_value()]

    await motor.set(30.0)
    found["moved"] = [await motor.motor_done_move.get_value(), *await position()]

    status = motor.set(5000.0)
    await wait_for_value(motor.user_readback, lambda there: there > 50.0, LONGEST_S)
    await motor.stop(success=True)
    await status
    await wait_for_value(motor.motor_done_move, 1, LONGEST_S)
    there, wanted = await position()
    found["stopped"] = [there == wanted, 0.0 < there < 5000.0]

    await motor.set(40.0)
    await motor.low_limit_travel.set(0.0)
    await motor.high_limit_travel.set(100.0)
    found["dial limits"] = [await motor.dial_low_limit_travel.get_value(), await motor.dial_high_limit_travel.get_value()]
    try:
        await motor.set(200.0)
    except MotorLimitsError:
        found["limit of the client"] = True
    found["limit of the record"] = [await refused(PREFIX, 200.0), await get("LVIO"), await position()]
    await motor.dial_low_limit_travel.set(0.0)
    await motor.dial_high_limit_travel.set(0.0)
    found["no limits"] = not await refused(PREFIX, 120.0)

    await motor.velocity.set(500.0)
    found["velocity"] = [await motor.velocity.get_value(), await motor.acceleration_time.get_value()]
    await motor.set_use_switch.set(UseSetMode.SET)
    await motor.user_setpoint.set(7.0)
    await motor.set_use_switch.set(UseSetMode.USE)
    found["set"] = [*await position(), await motor.offset.get_value(), await get("DRBV")]

    await aioca.caput(f"{PREFIX}.SPMG", "Pause", wait=True)
    status = motor.set(17.0)
    await wait_for_value(motor.user_setpoint, 17.0, LONGEST_S)
    found["paused"] = [await motor.motor_done_move.get_value(), status.done, (await position())[0]]
    await aioca.caput(f"{PREFIX}.SPMG", "Move", wait=True)
    await status
    found["moved on"] = [*await position(), await get("SPMG")]
    await aioca.caput(f"{PREFIX}.SPMG", "Go", wait=True)
    return found


print(json.dumps(asyncio.run(main())))
