"""Extent of what is recorded of a live world, for any studio of it."""

from __future__ import annotations

from pathlib import Path

from steptwin.live.world import MOST_INPUT_BYTES, MOST_INPUTS, LiveWorld
from steptwin.simulation.world import snapshotlog
from steptwin.studio.recordingrequests import PastState, RecordingFile, RecordingsOfWorld, RecordingState, TraceState


def recordings_of(
    live: LiveWorld,
    *,
    file: Path | None = None,
    folder: Path | None = None,
    saved: tuple[RecordingFile, ...] = (),
    formats: tuple[str, ...] = (),
) -> RecordingsOfWorld:
    """``file``: where the recording is written at the end; ``folder``: where others are saved, as ``saved``, and exported."""
    return RecordingsOfWorld(
        _recorded(live, file), _past(live), _trace(live), None if folder is None else str(folder), saved, formats
    )


def _recorded(live: LiveWorld, file: Path | None) -> RecordingState | None:
    if live.recorded is None:
        return None
    until, inputs, size, is_full = live.recorded
    return RecordingState(until, inputs, MOST_INPUTS, size, MOST_INPUT_BYTES, is_full, None if file is None else str(file))


def _past(live: LiveWorld) -> PastState | None:
    past = live.snapshots
    return None if past is None else PastState(past.begin, len(past), past.kept_inputs, snapshotlog.MOST_INPUTS)


def _trace(live: LiveWorld) -> TraceState:
    ring, file = live.ring, live.trace_file
    if ring is not None:
        return TraceState("ring", None if file is None else str(file), len(ring), ring.size, ring.begin)
    return TraceState("none", None, None, None, None) if file is None else TraceState("file", str(file), None, None, None)
