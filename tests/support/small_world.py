"""The names that `world_rig` had here before."""

from __future__ import annotations

from world_rig import moved, small

__all__ = ["moved", "small"]
