"""A picture of series over one scale of time: a panel for each point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import IO

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from steptwin.errors import Misuse
from steptwin.files.export.plot import POSITION_COLOR, STYLE, VELOCITY_COLOR
from steptwin.history.reading import PointSeries

MOST_PANELS = 24
_WIDTH_IN, _PANEL_IN = 12.0, 1.4
_COLORS = (POSITION_COLOR, VELOCITY_COLOR)


def draw(series: Mapping[str, Sequence[PointSeries]], file: IO[bytes], form: str) -> None:
    """For each title one series over the date, or two over the time since their begin. ``form`` is png or svg.

    Raises `Misuse` for what is not a number."""
    if len(series) > MOST_PANELS:
        raise Misuse(f"{len(series)} points: a picture shows at most {MOST_PANELS}")
    with rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH_IN, _PANEL_IN * len(series) + 0.8), layout="constrained")
        panels = figure.subplots(len(series), 1, sharex=True, squeeze=False)[:, 0]
        for panel, (title, found) in zip(panels, series.items(), strict=True):
            for one, color in zip(found, _COLORS, strict=False):
                if one.is_text:
                    raise Misuse(f"{one.point} has texts: a picture shows numbers")
                _draw(panel, one, color, since_begin=len(found) > 1)
            panel.set_title(title, loc="left", fontsize=8.5)
            panel.set_ylabel(found[0].unit)
            panel.grid(visible=True, linewidth=0.4)
        if any(len(found) > 1 for found in series.values()):
            panels[-1].set_xlabel("s since the begin of the run")
        else:
            panels[-1].set_xlabel("UTC")
        figure.savefig(file, format=form, dpi=120, metadata={"Date": None} if form == "svg" else None)


def _draw(panel: object, one: PointSeries, color: str, *, since_begin: bool) -> None:
    along = one.seconds - one.seconds[0] if since_begin and len(one) else one.at
    is_motion = one.point.endswith((".position", ".velocity"))
    style = "default" if is_motion else "steps-post"
    panel.plot(along, one.values.astype(np.float64), color=color, linewidth=1.0, drawstyle=style)  # type: ignore[attr-defined]
