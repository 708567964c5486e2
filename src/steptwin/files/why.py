"""Questions about the past of recordings."""

from __future__ import annotations

from steptwin.files.recording import Recording
from steptwin.why.replayedrun import ReplayedRun


def why_of_recording(recording: Recording) -> ReplayedRun:
    """Raises `Misuse` when its world cannot be made again."""
    return ReplayedRun(recording.world, recording.inputs, recording.until)
