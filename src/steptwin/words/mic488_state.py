"""A MIC488 as plain data and in words."""

from __future__ import annotations

from typing import NamedTuple

from steptwin.diagnostics import visible
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registers import AXIS_STATUS_TEXTS


class StatementPlace(NamedTuple):
    """A statement of a program's text."""

    file: str
    line: int
    text: str


def place_of(device: Mic488Device) -> StatementPlace | None:
    """The statement that the running or paused program is at; None when there is none."""
    running, span = device.program.running, device.program.statement(device.now)
    if running is None or span is None:
        return None
    source = running.source
    return StatementPlace(
        source.name, source.position(span.start)[0], visible(source.text[span.start : span.end].strip()) or "its end"
    )


def statement_of(device: Mic488Device) -> str | None:
    """The same in words: line and text."""
    place = place_of(device)
    return None if place is None else f"line {place.line}: {place.text}"


def empty_banks(name: str, device: Mic488Device) -> list[str]:
    """A configuration that starts a program nobody gave lights ERR at power-on, as on the device: why, and what to do."""
    bank, table = device.config.program.prog_bank, device.config.program.pos_bank
    if not device.config.program.activate:
        return []
    begin = f"ERR of {name} is on: Activate=1 starts program bank {bank} at power-on"
    program = device.program.programs.get(bank)
    if program is None:
        return [f"{begin}, which is empty (--program {bank}=FILE, or programs = {{ {bank} = 'FILE' }})"]
    if program.uses_positions and table not in device.program.positions:
        where = f"(--positions {table}=FILE, or positions = {{ {table} = 'FILE' }})"
        return [f"{begin} with position bank {table}, which is empty {where}"]
    return []


def _program_place(device: Mic488Device) -> dict[str, object]:
    place = place_of(device)
    return {} if place is None else place._asdict()


def state_of(device: Mic488Device, now: Nanos) -> dict[str, object]:
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
            "variables": device.program.variables(now),
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
