"""A client of its own process: a scan of Bluesky with ophyd-async's `Motor`. Prints what it finds as JSON.

EPICS_CA_ADDR_LIST of the environment says where the server is; the argument is the prefix.
"""

import json
import sys
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
from bluesky import RunEngine
from ophyd_async.core import init_devices
from ophyd_async.epics.core import epics_signal_r, epics_signal_rw
from ophyd_async.epics.motor import Motor

PREFIX = sys.argv[1]
documents: list[tuple[str, dict[str, Any]]] = []
engine = RunEngine(context_managers=[])
engine.subscribe(lambda name, document: documents.append((name, document)))
with init_devices():
    motor = Motor(f"{PREFIX}M1")
    enabled = epics_signal_rw(bool, f"{PREFIX}M1.CNEN")
    velocity = epics_signal_r(float, f"{PREFIX}M1:velocity")

engine(bps.mv(enabled, True))
engine(bp.scan([velocity], motor, 0.0, 40.0, 3))
events = [document["data"] for name, document in documents if name == "event"]
(described,) = [document for name, document in documents if name == "descriptor"]
found = {
    "positions": [event["motor"] for event in events],
    "velocities": [event["velocity"] for event in events],
    "unit": described["data_keys"]["motor"]["units"],
    "exit": documents[-1][1]["exit_status"],
}
print(json.dumps(found))
