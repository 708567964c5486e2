"""The options of commands that run a world in real time: `up` and `studio`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Speed = Annotated[
    str,
    typer.Option(help="Virtual seconds per second: 0.1, 1, 10; 'max' for worlds without external clients; 0 starts paused."),
]

Name = Annotated[str | None, typer.Option(help="Name by which --device finds it. Default: that of the file.")]

SessionFile = Annotated[Path | None, typer.Option(help="Write a session for 'steptwin replay' when it ends.")]

Trace = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        help="Write a trace to a file or into a directory; 'ring N' keeps the last N records for 'save'; 'off' keeps none. "
        "Default: that of the description.",
    ),
]

Faults = Annotated[
    list[str] | None,
    typer.Option(help="Fault active from the start, such as 'crc nth=3'; repeatable. See steptwin fault --kinds."),
]

Seed = Annotated[int | None, typer.Option(help="Random seed. Default: that of the description.")]

State = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Directory of the non-volatile memory. Default: that of the description, or none."),
]

Begin = Annotated[
    str | None,
    typer.Option("--from", metavar="TIME", help="Session: continue from this moment, such as 2.5s. Default: its end."),
]

ReadyFile = Annotated[Path | None, typer.Option(help="JSON file with the end points, written when all of them are open.")]

Control = Annotated[
    str | None,
    typer.Option(metavar="HOST:PORT", help="Also open the control endpoint on this loopback TCP address."),
]

ListenAny = Annotated[bool, typer.Option("--listen-any", help="Permit addresses that other computers can reach.")]

LogFrames = Annotated[
    bool, typer.Option("--log-frames", help="Print the traffic of every line with time, direction, bytes and meaning.")
]

Strict = Annotated[bool, typer.Option("--strict", help="Exit code 1 also for a wait that timed out.")]

AllowOutside = Annotated[bool, typer.Option("--allow-outside", help="Permit files outside the folder of the description.")]
