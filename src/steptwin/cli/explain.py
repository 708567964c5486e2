"""``steptwin explain``: what a program does, as far as its text shows.

From Python: `steptwin.explain.mic488.explain`, `steptwin.explain.m1486.explain`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.device import Json
from steptwin.cli.languageoptions import M1486FileOptions, WbcFileOptions, given_of
from steptwin.cli.optiongroups import grouped, option_of
from steptwin.cli.writtenfiles import written


@grouped
def command(
    file: Annotated[Path, typer.Argument(help="WBC program (.prg) or M1486 program.")],
    output: Annotated[
        Path | None, written("--output", "-o", help="A picture of the control flow: FILE.svg, instead of the text.")
    ] = None,
    json: Json = False,
    *,
    wbc: WbcFileOptions,
    chip: M1486FileOptions,
) -> None:
    """Explain a program without running it: control flow, durations, memory, inputs and outputs, where it can wait for ever.

    Also loops that it never leaves, interrupts that can be lost, and lines that are never reached.
    """
    from steptwin.cli.explain_pages import show

    show(file, given_of(wbc, chip), option_of, output, typer.echo, as_json=json)
