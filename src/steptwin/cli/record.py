"""``steptwin record``: requests to a twin or to the device with the answers, for 'diff'.

From Python: `steptwin.drivers.mic488.transcript`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Device, LogFrames, complain, find, opened
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse


def command(
    session: Annotated[
        Path, typer.Argument(help="The requests: get NAME..., set NAME=VALUE, wait AXIS..., sleep SECONDS, raw HEX.")
    ],
    output: Annotated[Path | None, written("-o", "--output", help="Where the transcript goes. Default: it is printed.")] = None,
    device: Device = None,
    log_frames: LogFrames = False,
) -> None:
    """Run a list of requests on a controller and record the answers. On Ctrl-C and on failures all axes are stopped.

    All lines are checked before the first is carried out.
    """
    from steptwin.drivers.mic488.kind import of_mic488
    from steptwin.drivers.mic488.named import map_of
    from steptwin.drivers.mic488.transcript import carry_out, steps_of, to_text
    from steptwin.files.textfiles import check_writable, write_bytes
    from steptwin.inputfiles import read_recorded

    text = read_recorded(session)
    if output is not None:
        check_writable(output)
    with opened(of_mic488(find(device), "record"), observe=False, log_frames=log_frames) as mic:
        try:
            steps = steps_of(text, map_of(mic))
        except Misuse as error:
            raise Misuse(f"{session}: {error}") from None
        about = {"device": mic.place, "unit": mic.unit, "firmware": mic.firmware, "session": session.name}
        kept: list[str] = []
        try:
            for line in to_text(carry_out(mic, steps), about):
                kept.append(line)
                if output is None:
                    typer.echo(line)
        except BaseException:
            mic.stop_all()
            complain("all axes were stopped")
            raise
        finally:
            if output is not None and kept[1:]:  # an earlier transcript is not given up for none
                write_bytes(output, ("\n".join(kept) + "\n").encode())
