"""A picture of a calculated move: velocity and position over time."""

from __future__ import annotations

from typing import IO

from matplotlib import rc_context
from matplotlib.figure import Figure

from steptwin.calc import Calculation
from steptwin.files.export.plot import POSITION_COLOR, STYLE, VELOCITY_COLOR

_SIZE_IN = (8.0, 4.5)


def write_profile_plot(result: Calculation, file: IO[bytes], form: str) -> None:
    """``form`` is png or svg."""
    points = result.curve
    moments = [point.time_s for point in points]
    with rc_context(STYLE):
        figure = Figure(figsize=_SIZE_IN, layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        upper.plot(moments, [point.velocity for point in points], color=VELOCITY_COLOR)
        upper.set_ylabel(f"velocity [{result.units['velocity']}]")
        lower.plot(moments, [point.position for point in points], color=POSITION_COLOR)
        lower.set_ylabel(f"position [{result.units['distance']}]")
        lower.set_xlabel("time [s]")
        for panel in (upper, lower):
            panel.margins(x=0.01)
            panel.spines[["top", "right"]].set_visible(False)
            for part in result.parts[1:]:
                panel.axvline(part.start_s, color="0.8", linewidth=0.8, zorder=0)
        figure.suptitle(f"{result.title}: {result.times['time']:.6g} s")
        figure.savefig(file, format=form, dpi=150, metadata={"Date": None} if form == "svg" else {"Software": None})
