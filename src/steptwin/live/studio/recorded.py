"""A recording to view: its world at the end, and its whole past."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files import recording as recordings
from steptwin.files.loader import is_recording
from steptwin.files.world import World
from steptwin.simulation.world.snapshotlog import SnapshotLog, replay

STATE_NS: Nanos = SECOND
"""A state is kept so often. [virtual time]"""


def recorded(path: Path, warn: Callable[[str], object]) -> tuple[World, SnapshotLog]:
    """Replay a recording. ``warn`` is called where the replay differs. Raises `Misuse` for a file that is none."""
    if not is_recording(path):
        raise Misuse(f"{path}: --view shows a recording (.json), as 'steptwin up --session FILE' records it")
    recording = recordings.load(path)
    world = recording.world(keep_trace=False, keep_inputs=False)
    snapshots = SnapshotLog(world)
    kept = world.now
    for _ in replay(world, recording.inputs, recording.until, STATE_NS):
        if world.now >= kept + STATE_NS:
            snapshots.take()
            kept = world.now
    snapshots.take()
    if world.trace.digest() != recording.digest:
        warn(f"{path}: the replay differs from the run recorded with steptwin {recording.version}; the replay is shown")
    world.go_on()
    return world, snapshots
