"""The causes of what is in a session."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from steptwin.durations import duration
from steptwin.files import session as sessions
from steptwin.files.why import why_of_session


def answer(path: Path, question: str, at: str | None, out: Callable[[str], object], *, as_json: bool = False) -> None:
    """Print the answer. Raises `Misuse` for a file that is no session, and for what is no question in it."""
    found = why_of_session(sessions.load(path)).ask(question, None if at is None else duration(at))
    out(json.dumps(found.plain(), ensure_ascii=False, indent=2) if as_json else found.text())
