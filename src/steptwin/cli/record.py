"""``steptwin record``, ``diff``: the same session with a twin and with the device, and where they differ.

From Python: `steptwin.drivers.mic488.session`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli.device import Device, Json, LogFrames, complain, find, opened, print_json
from steptwin.errors import Misuse


def record(
    session: Annotated[
        Path, typer.Argument(help="The session: get NAME..., set NAME=VALUE, wait AXIS..., sleep SECONDS, raw HEX.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Where the recording goes. Default: it is printed.")
    ] = None,
    device: Device = None,
    log_frames: LogFrames = False,
) -> None:
    """Run a list of requests on a controller and record the answers. On Ctrl-C and on failures all axes are stopped.

    All lines are checked before the first is carried out.
    """
    from steptwin.drivers.mic488.kind import of_mic488
    from steptwin.drivers.mic488.named import map_of
    from steptwin.drivers.mic488.session import carry_out, steps_of, to_text
    from steptwin.files.textfiles import check_writable, write_bytes

    text = _read(session)
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
            if output is not None and kept[1:]:  # an earlier recording is not given up for none
                write_bytes(output, ("\n".join(kept) + "\n").encode())


def diff(
    one: Annotated[Path, typer.Argument(help="A recording, of a twin for example.")],
    two: Annotated[Path, typer.Argument(help="Another of the same session, of the device.")],
    tolerance: Annotated[float, typer.Option(help="How far numbers may be apart.")] = 0.0,
    time: Annotated[
        float | None, typer.Option(help="How far moments may be apart, in seconds. Default: they do not matter.")
    ] = None,
    json: Json = False,
) -> None:
    """Report where two recordings of the same session differ. Exit code 1 if they do."""
    from steptwin.drivers.mic488.session import differences, from_text

    found = differences(from_text(_read(one), str(one)), from_text(_read(two), str(two)), tolerance=tolerance, time_s=time)
    if json:
        print_json([_data(d.step, d.line, d.what, d.one, d.two) for d in found])
    elif found:
        typer.echo("\n".join(map(str, found)))
    if found:
        raise typer.Exit(1)


def _data(step: int, line: str, what: str, one: Any, two: Any) -> dict[str, Any]:
    return {"step": step, "line": line, "what": what, "one": one, "two": two}


def _read(path: Path) -> str:
    from steptwin.inputfiles import read_recorded

    return read_recorded(path)
