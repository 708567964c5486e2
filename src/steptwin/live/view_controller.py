"""A controller of any kind in the live view, from its state and data sheet."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import groupby
from math import ceil, log10
from pathlib import Path

from rich.text import Text

from steptwin.controllerstate import ControllerState, StateAxis, StateProgram, StatusLevel, detail_text
from steptwin.datasheet import AxisDescription, Datasheet, Pin

_STYLES = {StatusLevel.OK: "green", StatusLevel.WARNING: "yellow", StatusLevel.ERROR: "bold red"}
_NUMBERED = re.compile(r"(.*?)(\d*)")
MOST_DECIMALS = 6


def controller_lines(name: str, state: ControllerState, sheet: Datasheet, width: int) -> list[Text]:
    """Status, program, axes, pins and details."""
    since = "" if state.time_s is None else f"  {state.time_s:9.1f} s"
    title = Text(f"{name}{since}  ", style="bold").append(state.status.text, style=_STYLES[state.status.level])
    heads = ["position", "velocity", *(["encoder"] if any(axis.encoder is not None for axis in state.axes) else [])]
    columns = max(1, min(len(heads), (width - 28) // 16))
    head = Text("   " + "".join(f" {text:>15}" for text in heads[:columns]) + "   status", style="dim")
    axes = [_axis(axis, described, columns) for axis, described in zip(state.axes, sheet.axes, strict=True)]
    groups = [_group(prefix, pins, state) for prefix, pins in groupby(sheet.pins, key=_prefix)]
    brief = (each for each in sheet.details if each.is_brief)
    details = (f"{each.name} {detail_text(state.details.get(each.name))} {each.unit}".rstrip() for each in brief)
    return [title, _program(state.program), head, *axes, *_wrapped(groups, width), *_wrapped(map(Text, details), width)]


def _program(program: StateProgram) -> Text:
    """The current place in the program if known, else the statement that is executed or comes next."""
    if program.file is not None and program.state is not None:
        where = f"{Path(program.file).name}:{program.line}  {program.statement}"
        return Text(f"program {program.state.value}, {where}", style="cyan")
    statement = "" if program.statement is None else f"   at: {program.statement}"
    return Text(f"program {program.text}{statement}", style="dim" if program.statement is None else "cyan")


def _axis(axis: StateAxis, described: AxisDescription, columns: int) -> Text:
    decimals = 0
    if described.pulses_per_unit is not None:
        decimals = min(max(ceil(log10(described.pulses_per_unit)), 0), MOST_DECIMALS)
    numbers = [
        "-" if axis.position is None else f"{axis.position:.{decimals}f} {axis.unit}",
        "-" if axis.velocity is None else f"{axis.velocity:.{decimals}f} {axis.unit}/s",
        "-" if axis.encoder is None else f"{axis.encoder}",
    ][:columns]
    text = Text(f"{axis.name} " + "".join(f" {number:>15}" for number in numbers))
    style = _STYLES[axis.status.level]
    if axis.status.level is StatusLevel.OK:
        style = "dim" if axis.enabled is False else "cyan" if axis.moving else "green"
    code = "" if axis.status.code is None else f"{axis.status.code:2d} "
    return text.append(f"  {code}{axis.status.text}", style=style)


def _prefix(pin: Pin) -> str:
    """``IN`` of ``IN12``; pins without a number stand together."""
    match = _NUMBERED.fullmatch(pin.name)
    return match[1] if match is not None and match[2] else ""


def _group(prefix: str, pins: Iterable[Pin], state: ControllerState) -> Text:
    """Digital pins that are high are lit, analog ones are in their unit."""
    text = Text(f"{prefix:<3}", style="bold") if prefix else Text()
    for pin in pins:
        level, label = state.pins.get(pin.name), pin.name.removeprefix(prefix)
        text.append(" ")
        if level is None:
            text.append(f"{label}?", style="not bold dim")
        elif pin.is_analog:
            number = f"{level:.2f}" if pin.unit else f"{label} {level:g}"
            text.append(f"{number} {pin.unit} ", style="not bold")
        else:
            text.append(label, style="not bold black on green" if level else "not bold dim")
    return text


def _wrapped(parts: Iterable[Text], width: int) -> Iterator[Text]:
    """Parts joined to lines, as many as fit."""
    line = Text()
    for part in parts:
        if line.cell_len and line.cell_len + 2 + part.cell_len > width:
            yield line
            line = Text()
        line = line.append("  " if line.cell_len else "").append_text(part)
    if line.cell_len:
        yield line
