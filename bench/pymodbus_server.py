"""pymodbus' own asynchronous server with static registers: ``pymodbus_server.py tcp PORT | rtu DEVICE``."""

from __future__ import annotations

import asyncio
import sys

from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice


async def main(kind: str, place: str) -> None:
    blocks = (
        [SimData(0, count=7000, values=False, datatype=DataType.BITS)],
        [SimData(0, count=16, values=False, datatype=DataType.BITS)],
        [SimData(0, count=12000, values=0, datatype=DataType.REGISTERS)],
        [SimData(0, count=16, values=0, datatype=DataType.REGISTERS)],
    )
    device = SimDevice(1, simdata=blocks)
    if kind == "tcp":
        server = ModbusTcpServer(device, address=("127.0.0.1", int(place)))
    else:
        server = ModbusSerialServer(device, port=place, baudrate=38400)
    await server.serve_forever(background=True)
    print("ready", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    try:
        import uvloop

        uvloop.install()
    except ImportError:
        pass
    asyncio.run(main(sys.argv[1], sys.argv[2]))
