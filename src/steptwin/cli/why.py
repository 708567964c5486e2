"""``steptwin why``: why something in a running twin or in a recording is as it is.

From Python: `steptwin.files.why.why_of_recording`, or `steptwin.files.world.World.why`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json

LONGEST_S = 60.0
"""Time-out of an answer of a twin, s."""


def command(
    where: Annotated[
        str,
        typer.Argument(
            metavar="TWIN|SESSION",
            help="A running twin: its name, file (.toml) or address; or a recording (.json) of 'steptwin run' or 'up'.",
            autocompletion=completion.devices,
        ),
    ],
    question: Annotated[
        str,
        typer.Argument(
            help="A signal (table.OUT3), a condition ('table.OUT3 == 0'), or a controller (table): what its program waits for. "
            "Default: the controller, where there is only one with a program.",
        ),
    ] = "",
    at: Annotated[str | None, typer.Option(metavar="TIME", help="The moment, such as 2.5s. Default: now, or the end.")] = None,
    json: Json = False,
) -> None:
    """Show the chain of causes of a value, of a condition or of a wait.

    A running twin answers if its past is kept: in the studio, or with 'steptwin up --past'.
    """
    _answer(where, question, at, typer.echo, as_json=json)


def _answer(where: str, question: str, at: str | None, out: Callable[[str], object], *, as_json: bool = False) -> None:
    """Print the answer. Raises `Misuse` for a file that is no recording, and for what is no question there; `Refusal` for a twin
    whose past is not kept."""
    found = _of_recording(Path(where), question, at) if Path(where).suffix == ".json" else _of_twin(where, question, at)
    out(json.dumps(found, ensure_ascii=False, indent=2) if as_json else found["text"])


def _of_recording(path: Path, question: str, at: str | None) -> Mapping[str, Any]:
    from steptwin.durations import duration
    from steptwin.files import recording as recordings
    from steptwin.files.why import why_of_recording

    return why_of_recording(recordings.load(path)).ask(question, None if at is None else duration(at)).to_json()


def _of_twin(text: str, question: str, at: str | None) -> Mapping[str, Any]:
    from steptwin.durations import duration
    from steptwin.live.remote import ask
    from steptwin.live.twins import find_controller
    from steptwin.subject.debugcommands import AskWhy

    twin, controller = find_controller(text)
    moment = None if at is None else duration(at)
    return ask(twin, AskWhy(question or controller or "", moment), timeout_s=LONGEST_S)
