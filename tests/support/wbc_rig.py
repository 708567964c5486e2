"""The names that `mic488_rig` had here before; it has all of this."""

from __future__ import annotations

from mic488_rig import MM, PAUSED, RUNNING, STOPPED, example, loaded, started
from mic488_rig import programmed as ProgramRig  # noqa: N812

__all__ = ["MM", "PAUSED", "RUNNING", "STOPPED", "ProgramRig", "example", "loaded", "started"]
