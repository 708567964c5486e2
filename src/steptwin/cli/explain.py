"""``steptwin explain``: what a program does, as far as its text shows.

From Python: `steptwin.explain.mic488.explain`, `steptwin.explain.m1486.explain`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json


def explain(
    file: Annotated[Path, typer.Argument(help="WBC program (.prg) or M1486 program.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="A picture of the control flow: FILE.svg, instead of the text.")
    ] = None,
    variant: Annotated[str | None, typer.Option(help="Type of M1486. Default A.", autocompletion=completion.variants)] = None,
    interface: Annotated[str | None, typer.Option(help="Driver interface of the M1486: sd, dual or two. Default sd.")] = None,
    positions: Annotated[
        Path | None, typer.Option(help="Position table of a WBC program. Default: the .csv of the same name.")
    ] = None,
    config: Annotated[Path | None, typer.Option(help="Configuration of its MIC488. Default: the .cfg of the same name.")] = None,
    firmware: Annotated[
        str | None, typer.Option(help="Firmware of the MIC488. Default 1.70.", autocompletion=completion.firmwares)
    ] = None,
    json: Json = False,
) -> None:
    """Explain a program without running it: control flow, durations, memory, inputs and outputs, where it can wait for ever.

    Also loops that it never leaves, interrupts that can be lost, and lines that are never reached.
    """
    from steptwin.commands.explain import ExplainOptions, show

    show(file, ExplainOptions(variant, interface, positions, config, firmware), output, typer.echo, as_json=json)
