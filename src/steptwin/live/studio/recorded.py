"""A recorded session to look at: its world at the end, and its whole past."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files import session as sessions
from steptwin.files.beginning import is_session
from steptwin.files.world import World
from steptwin.simulation.world.history import History, replay

STATE_NS: Nanos = SECOND
"""A state is kept so often. [virtual time]"""


def recorded(path: Path, warn: Callable[[str], object]) -> tuple[World, History]:
    """Replay a session. ``warn`` is called where the replay differs. Raises `Misuse` for a file that is none."""
    if not is_session(path):
        raise Misuse(f"{path}: --view shows a session (.json), as 'steptwin up --session FILE' records it")
    session = sessions.load(path)
    world = session.world(keep_trace=False, keep_inputs=False)
    history = History(world)
    kept = world.now
    for _ in replay(world, session.inputs, session.until, STATE_NS):
        if world.now >= kept + STATE_NS:
            history.take()
            kept = world.now
    history.take()
    if world.trace.digest() != session.digest:
        warn(f"{path}: the replay differs from the run recorded with steptwin {session.version}; the replay is shown")
    world.go_on()
    return world, history
