"""A MIC488 as plain data and in words."""

from __future__ import annotations

from typing import NamedTuple

from steptwin.diagnostics import visible
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.device import Mic488
from steptwin.mic488.registers import AXIS_STATUS_TEXTS


class Place(NamedTuple):
    """A statement of a program's text."""

    file: str
    line: int
    text: str


def place_of(device: Mic488) -> Place | None:
    """The statement that the running or paused program is at; None when there is none."""
    running, span = device.program.running, device.program.statement
    if running is None or span is None:
        return None
    source = running.source
    return Place(source.name, source.position(span.start)[0], visible(source.text[span.start : span.end].strip()) or "its end")


def _program_place(device: Mic488) -> dict[str, object]:
    place = place_of(device)
    return {} if place is None else place._asdict()


def state_of(device: Mic488, now: Nanos) -> dict[str, object]:
    """Status, program, axes, pins and user registers as plain data; positions in configured units."""
    return {
        "time_s": now / SECOND,
        "firmware": device.firmware.name,
        "status": int(device.status()),
        "program": {
            "state": device.program.state.name.lower(),
            "program_bank": device.program.program_bank,
            "position_bank": device.program.position_bank,
            **_program_place(device),
        },
        "data_type": "DINT" if device.data_type else "REAL",
        "axis_control_mode": "TRIGGER" if device.trigger_mode else "DIRECT",
        "axes": [
            {
                "axis": axis.number,
                "enabled": axis.enabled,
                "status": int(axis.status),
                "status_text": AXIS_STATUS_TEXTS[axis.status],
                "unit": axis.config.unit_name,
                "position": axis.coordinate_p(now) / axis.gear,
                "velocity": axis.profile.velocity(now) / axis.gear,
                "position_pulses": axis.coordinate_p(now),
                "encoder_counts": axis.encoder_counts(now),
            }
            for axis in device.axes
        ],
        "pins": dict(device.pins()),
        "user_registers": {str(n): word for n, word in enumerate(device.user) if word},
    }
