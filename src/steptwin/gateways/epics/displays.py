"""Displays for Phoebus from the static description: an overview, and one of each controller with panels of its motors."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial

from steptwin.datasheet import AxisDescription
from steptwin.gateways.epics.recordnames import commands_of, record_name
from steptwin.gateways.epics.widgets import RED, BobDisplay, BobElement
from steptwin.gateways.points import GatewayPoint, PointType, points_of
from steptwin.subject.contract import Description, MachinePart

OVERVIEW = "overview.bob"
WIDE, ROW = 460, 30
"""A panel, and a line in it, in pixels."""
PANEL = 10 * ROW + 20
COLUMNS = 2


def displays_of(description: Description, prefix: str, registers: Mapping[str, Iterable[str]]) -> dict[str, str]:
    """Texts by file name. ``registers``: the further points of each controller that the gateway serves."""
    found = {OVERVIEW: _overview(description, prefix)}
    for part in description.machines:
        points = points_of(part, description, registers[part.name])
        found[_file(part)] = _controller(part, points, prefix)
    return found


def _file(part: MachinePart) -> str:
    return f"controller-{part.name}.bob"


def _overview(description: Description, prefix: str) -> str:
    display = BobDisplay(description.name)
    most = max((len(part.datasheet.axes) for part in description.machines), default=0)
    for row, part in enumerate(description.machines):
        y = 60 + row * (ROW + 10)
        name = partial(record_name, prefix, part.name)
        display.opening(part.name, _file(part), (10, y, 140, ROW))
        display.value(name("status"), (160, y, 160, ROW))
        display.value(name("program", "state"), (330, y, 100, ROW))
        for path, _ in commands_of(part):
            if path == ("Stop",):
                display.button("Stop", name(*path), (440, y, 80, ROW), is_stop=True)
        for index, axis in enumerate(part.datasheet.axes):
            x = 530 + index * 190
            display.label(axis.name, (x, y, 40, ROW))
            display.value(f"{name(axis.name)}.RBV", (x + 45, y, 110, ROW))
            display.led(f"{name(axis.name)}.MOVN", (x + 160, y + 5, 20, 20))
    return display.text(550 + most * 190, 80 + len(description.machines) * (ROW + 10))


def _controller(part: MachinePart, points: tuple[GatewayPoint, ...], prefix: str) -> str:
    display = BobDisplay(part.name)
    name = partial(record_name, prefix, part.name)
    _head(display, part, prefix)
    below = 110
    for index, axis in enumerate(part.datasheet.axes):
        x, y = 10 + index % COLUMNS * (WIDE + 10), 110 + index // COLUMNS * (PANEL + 10)
        _motor(display, part, axis, name(axis.name), (x, y))
        below = y + PANEL + 10
    shown = [point for point in points if point.path[0] in ("pins", "details", "registers")]
    for index, point in enumerate(shown):
        x, y = 10 + index % 4 * 235, below + index // 4 * (ROW + 5)
        _point(display, point, name(*point.path), (x, y))
    return display.text(COLUMNS * (WIDE + 10) + 10, below + (len(shown) + 3) // 4 * (ROW + 5) + 10)


def _head(display: BobElement, part: MachinePart, prefix: str) -> None:
    name = partial(record_name, prefix, part.name)
    display.opening("Overview", OVERVIEW, (820, 10, 130, ROW))
    display.value(name("status"), (10, 60, 200, ROW))
    display.label("Program", (220, 60, 70, ROW))
    display.value(name("program", "text"), (290, 60, 260, ROW))
    for index, (path, row) in enumerate(commands_of(part)):
        text = row.name if len(path) > 1 else "Stop all"
        display.button(text, name(*path), (560 + index * 100, 60, 90, ROW), is_stop=row.name == "Stop")


def _motor(display: BobElement, part: MachinePart, axis: AxisDescription, motor: str, place: tuple[int, int]) -> None:
    """A panel: position, move, tweak, jog, home, stop, limits, state; without what the controller does not do."""
    taken = {one.command for one in part.takes if one.axis == axis.number}
    panel = display.widget("group", axis.name, (*place, WIDE, PANEL))
    line = _lines()
    y = next(line)
    panel.label("Position", (5, y, 90, ROW))
    panel.value(f"{motor}.RBV", (100, y, 150, ROW))
    panel.led(f"{motor}.MOVN", (260, y + 5, 20, 20))
    panel.label("moves", (285, y, 60, ROW))
    panel.button("STOP", f"{motor}.STOP", (350, y, 90, ROW), is_stop=True)
    y = next(line)
    panel.label("Move to", (5, y, 90, ROW))
    panel.value(f"{motor}.VAL", (100, y, 150, ROW), is_entry=True)
    panel.widget("combo", f"{motor}.SPMG", (260, y, 180, ROW), {"pv_name": f"{motor}.SPMG"})
    y = next(line)
    panel.label("Tweak", (5, y, 90, ROW))
    panel.button("−", f"{motor}.TWR", (100, y, 45, ROW))
    panel.value(f"{motor}.TWV", (150, y, 100, ROW), is_entry=True)
    panel.button("+", f"{motor}.TWF", (255, y, 45, ROW))
    if "jog" in taken:
        y = next(line)
        panel.label("Jog", (5, y, 90, ROW))
        panel.switch(f"{motor}.JOGR", "−", (100, y, 70, ROW), is_held=True)
        panel.switch(f"{motor}.JOGF", "+", (175, y, 70, ROW), is_held=True)
        panel.value(f"{motor}.JVEL", (255, y, 100, ROW), is_entry=True)
    if "home" in taken:
        y = next(line)
        panel.label("Home", (5, y, 90, ROW))
        panel.button("−", f"{motor}.HOMR", (100, y, 70, ROW))
        panel.button("+", f"{motor}.HOMF", (175, y, 70, ROW))
        panel.value(f"{motor}.HVEL", (255, y, 100, ROW), is_entry=True)
        panel.led(f"{motor}.ATHM", (365, y + 5, 20, 20))
        panel.label("home", (390, y, 60, ROW))
    y = next(line)
    panel.label("Limits", (5, y, 90, ROW))
    for x, end, switch in ((100, "LLM", "LLS"), (255, "HLM", "HLS")):
        panel.value(f"{motor}.{end}", (x, y, 110, ROW), is_entry=True)
        panel.led(f"{motor}.{switch}", (x + 115, y + 5, 20, 20), colour=RED)
    panel.led(f"{motor}.LVIO", (400, y + 5, 20, 20), colour=RED)
    if axis.velocity_point is not None:
        y = next(line)
        panel.label("Velocity", (5, y, 90, ROW))
        panel.value(f"{motor}.VELO", (100, y, 110, ROW), is_entry=True)
        panel.value(f"{motor}.ACCL", (255, y, 110, ROW), is_entry=True)
    y = next(line)
    panel.label("State", (5, y, 90, ROW))
    panel.value(f"{motor}:status", (100, y, 200, ROW))
    if "enable" in taken:
        panel.switch(f"{motor}.CNEN", "Drive", (310, y, 110, ROW))


def _lines() -> Iterator[int]:
    y = 5
    while True:
        yield y
        y += ROW + 2


def _point(display: BobElement, point: GatewayPoint, pv: str, place: tuple[int, int]) -> None:
    x, y = place
    display.label(point.path[-1], (x, y, 110, ROW))
    if point.type is not PointType.TRUTH:
        display.value(pv, (x + 115, y, 110, ROW), is_entry=point.write is not None)
    elif point.write is None:
        display.led(pv, (x + 115, y + 5, 20, 20))
    else:
        display.switch(pv, point.path[-1], (x + 115, y, 110, ROW))
