"""A client of its own process: pvaPy, which is made of EPICS' pvAccessCPP. Prints what it finds as JSON.

EPICS_PVA_ADDR_LIST and EPICS_PVA_BROADCAST_PORT, or EPICS_PVA_NAME_SERVERS, say where the server is; the argument is the prefix.
"""

import functools
import importlib
import json
import sys
import time
from collections.abc import Callable
from typing import Any

pvaccess: Any = importlib.import_module("pvaccess")  # compiled, and without types
PREFIX = sys.argv[1]
LONGEST_S = 30.0
NOT_WAITING = "record[block=false]field(value)"


@functools.cache
def channel(name: str) -> Any:
    return new_channel(name)


def new_channel(name: str) -> Any:
    found = pvaccess.Channel(f"{PREFIX}{name}")
    found.setTimeout(LONGEST_S)
    return found


def get(name: str, request: str = "field()") -> dict[str, Any]:
    return channel(name).get(request).toDict()


def value(name: str) -> Any:
    return get(name)["value"]


def put(name: str, *arguments: object) -> None:
    channel(name).put(*arguments)


def refused(name: str, wanted: object) -> str:
    try:
        put(name, wanted)
    except pvaccess.PvaException as error:
        return str(error)
    return "nothing"


def until(name: str, is_there: Callable[[Any], bool]) -> None:
    end = time.monotonic() + LONGEST_S
    while not is_there(value(name)):
        assert time.monotonic() < end, name
        time.sleep(0.01)


def structure(name: str) -> str:
    return str(channel(name).get("field()")).split(maxsplit=1)[0]


found: dict[str, Any] = {"types": [structure(name) for name in ("M1", "M1.DMOV", "M1.SPMG", "status", "pins:IN3")]}
found["while it is off"] = refused("M1", 10.0)
put("M1.CNEN", 1)

seen: list[float] = []
done = channel("M1.DMOV")
done.subscribe("seen", lambda one: seen.append(one["value"]))
done.startMonitor("field(value)")
until("M1.DMOV", lambda _: len(seen) == 1)
put("M1", 30.0)
found["moved"] = [value("M1.RBV"), value("M1"), value("M1.DMOV")]
put("M1.RLV", -10.0)
found["seen"] = seen
found["by"] = value("M1.RBV")
done.stopMonitor()

first = get("M1.RBV")
found["display"] = [first["display"][name] for name in ("units", "precision", "limitLow", "limitHigh", "description")]
found["time"] = abs(first["timeStamp"]["secondsPastEpoch"] - time.time()) < 10
found["alarm"] = first["alarm"]
found["velocity"] = [get("M1.VELO")["display"]["units"], get("M1.ACCL")["display"]["units"]]
put("M1.HLM", 40.0)
put("M1.LLM", -5.0)
limited = get("M1")
found["limits"] = [limited[place][name] for place in ("display", "control") for name in ("limitLow", "limitHigh")]
found["beyond"] = [refused("M1", 50.0), value("M1.LVIO"), value("M1")]
put("M1.DHLM", 0.0)
put("M1.DLLM", 0.0)

found["states"] = value("M1.SPMG")
found["no state"] = refused("M1.SPMG", 9)
found["read only"] = refused("M1.RBV", 1.0)
put("M1", 9000.0, NOT_WAITING)
until("M1.RBV", lambda there: there > 30.0)
found["on its way"] = value("M1.DMOV")
put("M1.STOP", 1)
until("M1.DMOV", lambda over: over == 1)
found["stopped"] = [value("M1") == value("M1.RBV"), value("M1.RBV") < 9000.0]

jog = new_channel("M1.JOGF")
jog.put(1, NOT_WAITING)
until("M1.DMOV", lambda over: over == 0)
del jog
until("M1.DMOV", lambda over: over == 1)
found["a jog ends with its channel"] = value("M1.JOGF")

put("pins:IN3", 1)
put("registers:USER_REGISTER[5]", 42.0)
found["values"] = [value("pins:IN3")["index"], value("registers:USER_REGISTER[5]"), value("status"), value("M1.NAME")]
found["unknown"] = get("program:line")["alarm"]
put("M1", 9000.0, NOT_WAITING)
until("M1.DMOV", lambda over: over == 0)
put("Stop", 1)
until("M1.DMOV", lambda over: over == 1)
found["stopped by the controller"] = value("M1.RBV") < 9000.0
print(json.dumps(found))
