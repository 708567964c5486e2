"""``steptwin picture``: a machine in space at a moment.

From Python: `steptwin.files.scene.picture.write_picture`.
"""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse


class ViewName(enum.StrEnum):
    ISO = "iso"
    FRONT = "front"
    SIDE = "side"
    TOP = "top"


def command(
    file: Annotated[Path, typer.Argument(help="The description of a world (.toml), or a recording (.json).")],
    output: Annotated[Path, written("--output", "-o", help="File to write: FILE.svg or FILE.png.")],
    at: Annotated[str, typer.Option(metavar="TIME", help="Virtual time of the picture: 9.5, 500ms, 2min.")] = "0",
    view: Annotated[ViewName, typer.Option(help="From where it is seen.")] = ViewName.ISO,
) -> None:
    """Draw the machine of a world at a moment, up to which the world runs in virtual time."""
    from steptwin.controller import SECOND
    from steptwin.files.loader import is_recording, load_world
    from steptwin.files.scene.picture import check_picture, write_picture
    from steptwin.files.scene.recorder import SceneRecorder
    from steptwin.files.timedinputs import parse_duration

    moment = parse_duration(at, "--at")
    check_picture(output)

    def warn(text: str) -> None:
        typer.echo(text, err=True)

    recorder, until = SceneRecorder(), moment if is_recording(file) else None
    with load_world(file, warn, moment=until, keep_trace=False, keep_inputs=False, begun=recorder.follow) as world:
        reason = world.run_to(moment) if world.now < moment else None
        if world.now < moment:
            raise Misuse(f"{file} ends at {world.now / SECOND:g} s ({reason}), before {moment / SECOND:g} s")
        write_picture(world, output, view.value, recorder)
    typer.echo(f"{output}: {world.spec.name} at {moment / SECOND:g} s")
