"""A MIC488 in the live view."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, log10
from pathlib import Path

from rich.text import Text

from steptwin.machine import SECOND, Nanos
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.present import place_of
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS
from steptwin.mic488.status import AxisStatus, ControllerStatus

_STYLES = {
    AxisStatus.OFF: "dim",
    AxisStatus.VELOCITY: "cyan",
    AxisStatus.POSITION: "cyan",
    AxisStatus.REACHED: "green",
    AxisStatus.ERROR: "bold red",
    AxisStatus.HOMING: "magenta",
    AxisStatus.CORRECTION: "yellow",
    AxisStatus.LIMIT_L: "yellow",
    AxisStatus.LIMIT_R: "yellow",
}


def controller_lines(name: str, device: Mic488Device, now: Nanos, width: int) -> list[Text]:
    """Status, program, axes, inputs and outputs."""
    status = device.status()
    title = Text(f"{name}  {now / SECOND:9.1f} s  ", style="bold")
    title.append(CONTROLLER_STATUS_TEXTS[status], style="green" if status is ControllerStatus.OK else "bold red")
    heads = ["position", "velocity", "encoder"][: _columns(width)]
    head = Text("   " + "".join(f" {text:>15}" for text in heads) + "   status", style="dim")
    return [title, *_program(device), head, *(_axis(axis, now, width) for axis in device.axes), *_pins(device)]


def _program(device: Mic488Device) -> list[Text]:
    """What the program is at; nothing for a controller without any."""
    place = place_of(device)
    if place is None:
        return [Text("program stopped", style="dim")] if device.program.programs else []
    return [
        Text(f"program {device.program.state.name.lower()}, {Path(place.file).name}:{place.line}  {place.text}", style="cyan")
    ]


def _columns(width: int) -> int:
    """How many columns of numbers have room beside the status."""
    return max(1, min(3, (width - 28) // 16))


def _axis(axis: Axis, now: Nanos, width: int) -> Text:
    unit = axis.config.unit_name
    decimals = min(max(ceil(log10(axis.gear)), 0), 6)
    numbers = [
        f"{axis.coordinate_p(now) / axis.gear:.{decimals}f} {unit}",
        f"{axis.profile.velocity(now) / axis.gear:.{decimals}f} {unit}/s",
        f"{axis.encoder_counts(now)}",
    ][: _columns(width)]
    text = Text(f"M{axis.number} " + "".join(f" {number:>15}" for number in numbers))
    return text.append(f"  {axis.status:2d} {AXIS_STATUS_TEXTS[axis.status]}", style=_STYLES.get(axis.status, ""))


def _pins(device: Mic488Device) -> list[Text]:
    inputs = _lamps("IN ", device.inputs.filtered)
    outputs = _lamps("OUT", device.outputs)
    outputs.append("  AIN ", style="bold").append("  ".join(f"{volts:.2f} V" for volts in device.analog_v))
    outputs.append("  ERR", style="bold white on red" if device.error_led else "dim")
    return [inputs, outputs]


def _lamps(name: str, states: Iterable[bool]) -> Text:
    text = Text(f"{name} ", style="bold")
    for number, on in enumerate(states, start=1):
        text.append(f"{number}", style="not bold black on green" if on else "not bold dim").append(" ", style="not bold")
    return text
