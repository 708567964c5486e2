"""Questions about the past of sessions."""

from __future__ import annotations

from steptwin.files.session import Session
from steptwin.why.question import Why


def why_of_session(session: Session) -> Why:
    """Raises `Misuse` when its world cannot be made again."""
    return Why(session.world, session.inputs, session.until)
