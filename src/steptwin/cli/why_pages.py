"""The causes of what is in a session, or in a running twin."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from steptwin.durations import duration
from steptwin.files import session as sessions
from steptwin.files.why import why_of_session
from steptwin.live.remote import ask
from steptwin.live.twins import find_controller
from steptwin.subject.debugcommands import AskWhy

LONGEST_S = 60.0
"""Time-out of an answer of a twin, s."""


def answer(where: str, question: str, at: str | None, out: Callable[[str], object], *, as_json: bool = False) -> None:
    """Print the answer. Raises `Misuse` for a file that is no session, and for what is no question there; `Refusal` for a twin
    whose past is not kept."""
    found = _of_session(Path(where), question, at) if Path(where).suffix == ".json" else _of_twin(where, question, at)
    out(json.dumps(found, ensure_ascii=False, indent=2) if as_json else found["text"])


def _of_session(path: Path, question: str, at: str | None) -> Mapping[str, Any]:
    return why_of_session(sessions.load(path)).ask(question, None if at is None else duration(at)).plain()


def _of_twin(text: str, question: str, at: str | None) -> Mapping[str, Any]:
    twin, controller = find_controller(text)
    moment = None if at is None else duration(at)
    return ask(twin, AskWhy(question or controller or "", moment), timeout_s=LONGEST_S)
