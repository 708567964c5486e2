"""A recording to view: its world at the end, and its whole past."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files import recording as recordings
from steptwin.files.loader import is_recording
from steptwin.files.world import World
from steptwin.inputfiles import MOST_RECORDED_BYTES
from steptwin.messages import Message
from steptwin.simulation.world.snapshotlog import SLICE_NS, SnapshotLog, replay

STATE_NS: Nanos = SECOND
"""A state is kept so often. [virtual time]"""
REPLAY_DIFFERS = Message(
    "live.replay-differs", "{path}: the replay differs from the run recorded with steptwin {version}; the replay is shown"
)

Replayed: TypeAlias = tuple[World, SnapshotLog, str]


def replayed(path: Path, most: int = MOST_RECORDED_BYTES) -> Generator[None, None, Replayed]:
    """Replay a recording of at most ``most`` bytes, in parts; the text tells where the replay differs, and is empty otherwise.
    Raises `Misuse` for a file that is none."""
    if not is_recording(path):
        raise Misuse(f"{path}: --view shows a recording (.json), as 'steptwin up --session FILE' records it")
    recording = yield from recordings.loading(path, most)
    world = recording.world(keep_trace=False, keep_inputs=False)
    snapshots = SnapshotLog(world)
    kept = world.now
    for _ in replay(world, recording.inputs, recording.until, SLICE_NS):
        if world.now >= kept + STATE_NS:
            snapshots.take()
            kept = world.now
        yield
    snapshots.take()
    is_same = world.trace.digest() == recording.digest
    world.go_on()
    return world, snapshots, "" if is_same else REPLAY_DIFFERS(path=path, version=recording.version)
