"""``steptwin info``: a controller at a glance.

From Python: `steptwin.drivers.Mic488.status`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from steptwin.cli.chip import info as chip_info
from steptwin.cli.device import Device, Json, LogFrames, find, opened, print_json, shown, table

if TYPE_CHECKING:
    from steptwin.drivers import Mic488, Mic488Status

_PROGRAM = {0: "stopped", 1: "running", 2: "paused"}


def info(device: Device = None, json: Json = False, log_frames: LogFrames = False) -> None:
    """Show what a controller is and what it is doing."""
    address = find(device)
    if address.kind == "m1486":
        chip_info(address, json=json, log_frames=log_frames)
        return
    with opened(address, log_frames=log_frames) as mic:
        status = mic.status()
        data_type = "DINT" if mic.get("DATA_TYPE")["DATA_TYPE"] else "REAL"
        firmwares = [mic.firmware] if address.firmware is not None else _firmwares(mic.firmware, status)
        data = _data(mic, status, data_type, firmwares)
    if json:
        print_json(data)
    else:
        typer.echo("\n".join(_lines(data, status)))


def _firmwares(found: str, status: Mic488Status) -> list[str]:
    """The firmwares that answer as the one that was found: 1.40 has the addresses of 1.70, and its M_STATUS is always 0."""
    return ["1.70", "1.40"] if found == "1.70" and not status.controller else [found]


def _data(mic: Mic488, status: Mic488Status, data_type: str, firmwares: list[str]) -> dict[str, Any]:
    from steptwin.drivers.mic488.motion import status_text

    axes = [
        {"axis": number, "position": position, "velocity": velocity, "unit": unit, "status": code, "meaning": status_text(code)}
        for number, position, velocity, unit, code in zip(
            range(1, 5), status.positions, status.velocities, status.units, status.axes, strict=True
        )
    ]
    return {
        "device": mic.place,
        "unit": mic.unit,
        "firmware": mic.firmware,
        "firmware_may_be": firmwares,
        "data_type": data_type,
        "status": status.controller,
        "program": _PROGRAM.get(status.program, str(status.program)),
        "axes": axes,
        "inputs": list(status.inputs),
        "outputs": list(status.outputs),
    }


def _lines(data: dict[str, Any], status: Mic488Status) -> list[str]:
    from steptwin.mic488.registers import CONTROLLER_STATUS_TEXTS

    firmware = " or ".join(data["firmware_may_be"])
    state = "" if status.controller is None else f", {CONTROLLER_STATUS_TEXTS.get(status.controller, status.controller)}"
    rows = [
        (f"M{a['axis']}", shown(a["position"]), a["unit"], shown(a["velocity"]), f"{a['unit']}/s", str(a["status"]), a["meaning"])
        for a in data["axes"]
    ]
    return [
        f"MIC488, unit {data['unit']} at {data['device']}, firmware {firmware}{state}",
        f"program {data['program']}, values travel as {data['data_type']}",
        table(rows),
        f"inputs on:  {_on('IN', status.inputs)}",
        f"outputs on: {_on('OUT', status.outputs)}",
    ]


def _on(name: str, states: tuple[bool, ...]) -> str:
    return " ".join(f"{name}{number}" for number, on in enumerate(states, start=1) if on) or "none"
