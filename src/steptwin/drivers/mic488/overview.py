"""A MIC488 at a glance."""

from __future__ import annotations

from steptwin.drivers.kind import DeviceAddress, DeviceOverview
from steptwin.drivers.mic488.driver import Mic488Status
from steptwin.drivers.mic488.motion import status_text
from steptwin.drivers.mic488.sync import Mic488
from steptwin.mic488.registers import CONTROLLER_STATUS_TEXTS

_PROGRAM = {0: "stopped", 1: "running", 2: "paused"}


def overview(mic: Mic488, address: DeviceAddress) -> DeviceOverview:
    status = mic.status()
    data_type = "DINT" if mic.get("DATA_TYPE")["DATA_TYPE"] else "REAL"
    firmwares = [mic.firmware] if address.variant is not None else _firmwares(mic.firmware, status)
    program = _PROGRAM.get(status.program, str(status.program))
    axes = [
        {"axis": number, "position": position, "velocity": velocity, "unit": unit, "status": code, "meaning": status_text(code)}
        for number, position, velocity, unit, code in zip(
            range(1, 5), status.positions, status.velocities, status.units, status.axes, strict=True
        )
    ]
    data = {
        "device": mic.place,
        "unit": mic.unit,
        "firmware": mic.firmware,
        "firmware_may_be": firmwares,
        "data_type": data_type,
        "status": status.controller,
        "program": program,
        "axes": axes,
        "inputs": list(status.inputs),
        "outputs": list(status.outputs),
    }
    state = "" if status.controller is None else f", {CONTROLLER_STATUS_TEXTS.get(status.controller, status.controller)}"
    head = (
        f"MIC488, unit {mic.unit} at {mic.place}, firmware {' or '.join(firmwares)}{state}",
        f"program {program}, values travel as {data_type}",
    )
    rows = [(f"M{a['axis']}", a["position"], a["unit"], a["velocity"], f"{a['unit']}/s", a["status"], a["meaning"]) for a in axes]
    return DeviceOverview(
        data, head, rows, (f"inputs on:  {_on('IN', status.inputs)}", f"outputs on: {_on('OUT', status.outputs)}")
    )


def _firmwares(found: str, status: Mic488Status) -> list[str]:
    """The firmwares that answer as the one that was found: 1.40 has the addresses of 1.70, and its M_STATUS is always 0."""
    return ["1.70", "1.40"] if found == "1.70" and not status.controller else [found]


def _on(name: str, states: tuple[bool, ...]) -> str:
    return " ".join(f"{name}{number}" for number, on in enumerate(states, start=1) if on) or "none"
