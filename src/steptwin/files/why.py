"""Questions about the past of sessions."""

from __future__ import annotations

from steptwin.files.session import Session
from steptwin.why.repeated import RepeatedPast


def why_of_session(session: Session) -> RepeatedPast:
    """Raises `Misuse` when its world cannot be made again."""
    return RepeatedPast(session.world, session.inputs, session.until)
