"""``steptwin send``: a program into a device.

From Python: `steptwin.drivers.m1486.M1486.download`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Device, Json, LogFrames, SuspensionDetector, find, kind_of, log_of, print_json


def command(
    file: Annotated[Path, typer.Argument(help="The program.")],
    device: Device = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Download a program into an M1486. A program in [ ] starts at its ]: the motor may move. E types are erased first.

    A program that selects chips with X is sent to all of them; --device then names their line: ADDRESS,kind=m1486, or the twin.
    """
    from steptwin.drivers.kind import DriverKind
    from steptwin.drivers.kinds import DRIVERS
    from steptwin.files.textfiles import read_text

    text = read_text(file).source.text
    # A program that no device of its kind takes needs no device.
    of_file = (kind for kind in DRIVERS.values() if file.suffix.lower() in kind.programs)
    refused = [kind for kind in of_file if not kind.offers(DriverKind.send)]
    address = None if refused else find(device, whole_line=True)
    kind = refused[0] if address is None else kind_of(address)
    if address is None or not kind.offers(DriverKind.send):
        raise kind.not_sent(file)
    held_up = SuspensionDetector()
    with _progress(file.name) as progress:
        sent = kind.send(address, file, text, progress, held_up.check, log_of(log_frames))
    if json:
        print_json(sent.data)
    else:
        typer.echo(sent.text)


@contextlib.contextmanager
def _progress(title: str) -> Generator[Callable[[int, int], object]]:
    """A progress bar on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title)
        yield lambda done, total: bar.update(task, completed=done, total=total)
