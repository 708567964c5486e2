"""``steptwin why``: why something in a running twin or in a recording is as it is.

From Python: `steptwin.files.why.why_of_recording`, or `steptwin.files.world.World.why`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

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
    everything: Annotated[bool, typer.Option("--all", help="All that is found, not only the first sixteen causes.")] = False,
    try_without: Annotated[
        bool,
        typer.Option(
            help="Repeat the run without each root (an input, an action of a script, a request, a fault) and show what would be. "
            "Includes --all.",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Show the chain of causes of a value, of a condition or of a wait.

    A running twin answers if its past is kept: in the studio, or with 'steptwin up --past'.
    """
    asked = WhyQuestion(question, at, everything=everything, try_without=try_without)
    _answer(where, asked, typer.echo, as_json=json)


class WhyQuestion(NamedTuple):
    """A question as it was typed."""

    text: str
    at: str | None
    everything: bool = False
    try_without: bool = False


def _answer(where: str, asked: WhyQuestion, out: Callable[[str], object], *, as_json: bool = False) -> None:
    """Print the answer. Raises `Misuse` for a file that is no recording, and for what is no question there; `Refusal` for a twin
    whose past is not kept."""
    found = _of_recording(Path(where), asked) if Path(where).suffix == ".json" else _of_twin(where, asked)
    out(json.dumps(found, ensure_ascii=False, indent=2) if as_json else found["text"])


def _of_recording(path: Path, asked: WhyQuestion) -> Mapping[str, Any]:
    from steptwin.durations import duration
    from steptwin.files import recording as recordings
    from steptwin.files.why import why_of_recording

    at = None if asked.at is None else duration(asked.at)
    past = why_of_recording(recordings.load(path))
    return past.ask(asked.text, at, try_without=asked.try_without, everything=asked.everything).to_json()


def _of_twin(text: str, asked: WhyQuestion) -> Mapping[str, Any]:
    from steptwin.durations import duration
    from steptwin.live.remote import ask
    from steptwin.live.twins import find_controller
    from steptwin.subject.debugcommands import AskWhy

    twin, controller = find_controller(text)
    moment = None if asked.at is None else duration(asked.at)
    wanted = AskWhy(asked.text or controller or "", moment, asked.everything, asked.try_without)
    return ask(twin, wanted, timeout_s=LONGEST_S)
