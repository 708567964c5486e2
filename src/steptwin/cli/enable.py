"""``steptwin enable``: the drives of axes.

From Python: `steptwin.drivers.Mic488` and its axes, `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

from steptwin.cli.device import Axes, Device, LogFrames
from steptwin.cli.motions import switch_drives


def command(axes: Axes = None, device: Device = None, log_frames: LogFrames = False) -> None:
    """Switch drives on."""
    switch_drives("enable", axes, device, log_frames=log_frames)
