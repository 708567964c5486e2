"""Picture of a machine in space at the last moment that was recorded."""

from __future__ import annotations

import enum
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.extras import lacking, missing
from steptwin.files.scene.recorder import SceneRecorder
from steptwin.files.scene.scenescript import SceneScript
from steptwin.files.textfiles import check_writable, new_file
from steptwin.files.writing import is_written_directly
from steptwin.inputfiles import format_path
from steptwin.simulation.world.simulation import Simulation

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


def write_picture(
    world: Simulation, where: Path | str, view: View | str = View.ISO, recorder: SceneRecorder | None = None
) -> None:
    """Write a picture of a machine at the present moment; the suffix selects svg or png. ``recorder``: it has followed the world,
    and knows what bodies have drawn. Raises `Misuse` for a world without places in space, and for a file that cannot be
    written."""
    where = Path(where)
    check_picture(where)
    text = picture(world, View(view), recorder)
    if where.suffix.lower() == ".png":
        import resvg_py

        content = resvg_py.svg_to_bytes(svg_string=text, skip_system_fonts=True)
    else:
        content = text.encode()
    with new_file(where) as file:
        file.write(content)


def picture(world: Simulation, view: View, recorder: SceneRecorder | None = None) -> str:
    """The text of an SVG. Raises `Misuse` as `write_picture`."""
    if recorder is None:
        recorder = SceneRecorder()
        recorder.follow(world, ends=True)
    scene = recorder.recorded()
    if scene is None:
        raise Misuse(
            f"{world.spec.name} has no places in space, so nothing can be drawn: "
            "give its elements at, on or along (docs/space.md)"
        )
    return SceneScript().call("picture", scene.to_json(), world.now, view, WIDTH_PX)
