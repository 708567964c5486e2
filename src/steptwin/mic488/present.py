"""The present state of a MIC488, and the place in its program."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.controllerstate import (
    ProgramActivity,
    StateAxis,
    StateProgram,
    StateReader,
    StateStatus,
    StatusLevel,
)
from steptwin.datasheet import AxisDescription, Datasheet
from steptwin.diagnostics import visible
from steptwin.mic488.datasheet import datasheet
from steptwin.mic488.details import DETAILS
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS
from steptwin.mic488.status import AxisStatus, ControllerStatus, ProgramState

ACTIVITIES: Mapping[int, ProgramActivity] = {
    ProgramState.STOPPED: ProgramActivity.STOPPED,
    ProgramState.RUNNING: ProgramActivity.RUNNING,
    ProgramState.PAUSED: ProgramActivity.PAUSED,
}
_LEVELS: Mapping[int, StatusLevel] = {
    AxisStatus.ERROR: StatusLevel.ERROR,
    AxisStatus.LIMIT_L: StatusLevel.WARNING,
    AxisStatus.LIMIT_R: StatusLevel.WARNING,
}


MOST_KEPT = 64
"""Statuses whose meaning is kept."""


class SourceLine(NamedTuple):
    """A statement of a program's text."""

    file: str
    line: int
    text: str


def current_line(device: Mic488Device) -> SourceLine | None:
    """The statement that the running or paused program is at; None when there is none."""
    running, span = device.program.running, device.program.statement(device.now)
    if running is None or span is None:
        return None
    source = running.source
    return SourceLine(
        source.name, source.position(span.start)[0], visible(source.text[span.start : span.end].strip()) or "its end"
    )


def empty_banks(name: str, device: Mic488Device) -> list[str]:
    """Reason and remedy for ERR at power-on, as on the device: the configuration starts a program whose bank is empty."""
    bank, table = device.config.program.prog_bank, device.config.program.pos_bank
    if not device.config.program.activate:
        return []
    begin = f"ERR of {name} is on: Activate=1 starts program bank {bank} at power-on"
    program = device.program.banks.programs.get(bank)
    if program is None:
        return [f"{begin}, which is empty (--program {bank}=FILE, or programs = {{ {bank} = 'FILE' }})"]
    if program.uses_positions and table not in device.program.banks.positions:
        where = f"(--positions {table}=FILE, or positions = {{ {table} = 'FILE' }})"
        return [f"{begin} with position bank {table}, which is empty {where}"]
    return []


@lru_cache(MOST_KEPT)
def controller_status(code: int) -> StateStatus:
    """The meaning of register M_STATUS."""
    level = StatusLevel.OK if code == ControllerStatus.OK else StatusLevel.ERROR
    return StateStatus(code=int(code), text=CONTROLLER_STATUS_TEXTS.get(code, f"unknown status {code}"), level=level)


@lru_cache(MOST_KEPT)
def axis_status(code: int) -> StateStatus:
    """The meaning of a register Mx_STATUS."""
    text = AXIS_STATUS_TEXTS.get(code, f"unknown status {code}")
    return StateStatus(code=int(code), text=text, level=_LEVELS.get(code, StatusLevel.OK))


class Mic488State(StateReader[Mic488Device]):
    """Positions in configured units; user registers that are 0 are left out."""

    details = DETAILS

    def datasheet(self, device: Mic488Device) -> Datasheet:
        return datasheet(device)

    def status(self, device: Mic488Device, now: Nanos) -> StateStatus:
        return controller_status(device.status())

    def program(self, device: Mic488Device, now: Nanos) -> StateProgram:
        line, fault = current_line(device), device.program.fault
        activity = ACTIVITIES[device.program.state]
        text = activity.value
        if line is not None:
            text += f" at line {line.line}: {line.text}"
        elif fault is not None:
            text += f" by an error: {fault.text}"
        return StateProgram(
            state=activity,
            text=text,
            file=None if line is None else line.file,
            line=None if line is None else line.line,
            statement=None if line is None else line.text,
            variables=device.program.variables(now),
        )

    def axis(self, device: Mic488Device, described: AxisDescription, now: Nanos) -> StateAxis:
        axis = device.axes[described.number - 1]
        return StateAxis(
            number=axis.number,
            name=described.name,
            unit=described.unit,
            position=axis.coordinate_p(now) / axis.gear,
            velocity=axis.profile.velocity(now) / axis.gear,
            moving=axis.profile.moving(now),
            enabled=axis.enabled,
            encoder=axis.encoder_counts(now),
            status=axis_status(axis.status),
        )


state_of = Mic488State()
