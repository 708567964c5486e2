"""Picture of a machine in space at the present moment of its world."""

from __future__ import annotations

import enum
from math import isfinite
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.extras import lacking, missing
from steptwin.files.scene.recordedscene import machine_of
from steptwin.files.scene.scenescript import SceneScript
from steptwin.files.textfiles import check_writable, new_file
from steptwin.files.writing import is_written_directly
from steptwin.inputfiles import format_path
from steptwin.jsonvalues import to_json
from steptwin.simulation.world.simulation import Simulation
from steptwin.subject.describe import describe, workpiece_states

SUFFIXES = (".svg", ".png")
WIDTH_PX = 1200
"""Longer side of a picture."""


class View(enum.StrEnum):
    ISO = "iso"
    FRONT = "front"
    SIDE = "side"
    TOP = "top"


def check_picture(where: Path) -> None:
    """Check in advance that a picture can be drawn and written to a file. Raises `Misuse`."""
    if lacking("scene"):
        raise missing("a picture", "scene")
    if where.suffix.lower() not in SUFFIXES and not is_written_directly(where):
        raise Misuse(f"cannot write {format_path(where)}: pictures are {' or '.join(SUFFIXES)}")
    check_writable(where)


def write_picture(world: Simulation, where: Path | str, view: View | str = View.ISO) -> None:
    """Write a picture of a machine at the present moment; the suffix selects svg or png. Raises `Misuse` for a world without
    places in space, and for a file that cannot be written."""
    where = Path(where)
    check_picture(where)
    text = picture(world, View(view))
    if where.suffix.lower() == ".png":
        import resvg_py

        content = resvg_py.svg_to_bytes(svg_string=text, skip_system_fonts=True)
    else:
        content = text.encode()
    with new_file(where) as file:
        file.write(content)


def picture(world: Simulation, view: View) -> str:
    """The text of an SVG. Raises `Misuse` as `write_picture`."""
    machine = machine_of(describe(world))
    if not machine.scene.frames:
        raise Misuse(
            f"{machine.name} has no places in space, so nothing can be drawn: give its elements at, on or along (docs/space.md)"
        )
    script = SceneScript(machine)
    workpieces = tuple(workpiece_states(world))
    wanted = script.wanted()
    names = (*wanted["signals"], *wanted["levels"], *(move.signal for one in workpieces for move in one.moves))
    values = {name: _value(world, name) for name in names}
    return script.call("picture", {"values": values, "workpieces": to_json(workpieces)}, view, WIDTH_PX)


def _value(world: Simulation, name: str) -> float | None:
    """None where it is unknown, and for a terminal that cannot be read."""
    try:
        value = world.read(name)
    except Misuse:
        return None
    return value if isfinite(value) else None
