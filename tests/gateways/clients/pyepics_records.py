"""A client of its own process: pyepics. Prints what it finds as JSON. EPICS_CA_ADDR_LIST says where the server is."""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import epics

PREFIX = sys.argv[1]
LONGEST_S = 30.0


def get(name: str, **options: Any) -> Any:
    return epics.caget(f"{PREFIX}{name}", use_monitor=False, timeout=10, **options)


def put(name: str, value: object) -> None:
    assert epics.caput(f"{PREFIX}{name}", value, wait=True, timeout=30) == 1


def until(name: str, is_there: Callable[[Any], bool]) -> None:
    end = time.monotonic() + LONGEST_S
    while not is_there(get(name)):
        assert time.monotonic() < end, name
        time.sleep(0.01)


put("M1.CNEN", 1)
put("M1.HLM", 1e6)  # pyepics checks limits itself, and takes 0 and 0 for limits
put("M1.LLM", -1e6)
motor = epics.Motor(f"{PREFIX}M1")
motor.move(20, wait=True, timeout=30)
found: dict[str, Any] = {"moved": [motor.get_position(readback=True), get("M1.DMOV"), get("M1.MOVN")]}
put("M1.TWV", 3)
put("M1.TWR", 1)
found["tweaked"] = [get("M1.RBV"), get("M1.TWR")]
put("M1.DIR", "Neg")
found["turned"] = [get("M1.RBV"), get("M1.DRBV"), get("M1.OFF")]
put("M1.DIR", "Pos")

epics.caput(f"{PREFIX}M1.JOGF", 1)
until("M1.DMOV", lambda done: done == 0)
until("M1.RBV", lambda there: there > 20)
found["jogs"] = [get("M1.JOGF"), bool(get("M1.MSTA") & 1 << 10)]
put("M1.JOGF", 0)
until("M1.DMOV", lambda done: done == 1)
found["jogged"] = [get("M1.JOGF"), get("M1.VAL") == get("M1.RBV"), get("M1.RBV") > 17.0]

put("pins:IN3", 1)
put("registers:USER_REGISTER[5]", 42)
found["values"] = [get("pins:IN3"), get("registers:USER_REGISTER[5]"), get("status"), get("M1.EGU"), get("M1.NAME")]
found["alarm"] = epics.PV(f"{PREFIX}M1").get_with_metadata(form="time", timeout=10)["severity"]
epics.caput(f"{PREFIX}M1.VAL", 9000)
until("M1.DMOV", lambda done: done == 0)
put("Stop", 1)
until("M1.DMOV", lambda done: done == 1)
found["stopped"] = [get("M1.VAL") == get("M1.RBV"), get("M1.RBV") < 9000]
print(json.dumps(found))
