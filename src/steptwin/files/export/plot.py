"""A picture of a recording: position and velocity of every axis, levels of pins, frames and events over one scale of time.

Curves are polylines of few points, not dense samples, so that a picture of an hour takes as long as one of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from steptwin.controller import SECOND, Nanos
from steptwin.files.export.polyline import curve
from steptwin.files.export.progress import TimeProgress
from steptwin.files.export.tracetracks import TraceTracks
from steptwin.files.export.tracks import AxisTrack, PinTrack
from steptwin.motion.divisions import profile_of
from steptwin.motion.pulses import Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_AXES = 16
MOST_ROWS = 48
"""More would not be legible."""

_WIDTH_IN = 12.0
_LEFT_IN, _RIGHT_IN, _TOP_IN, _BOTTOM_IN = 1.5, 0.3, 0.55, 0.55
_SCALE_IN, _MARGIN_IN = 0.55, 0.12
"""Left of a panel: room for the numbers of its scale, then its label, then the margin."""
_MOTION_IN, _ROW_IN, _GAP_IN = 0.78, 0.24, 0.1
_COLUMNS = 1500
"""Number of pixels across the picture: more points than a few in each are not seen."""
_GREY = "(grey: commanded)"
_CLOCK_STEPS_S = (30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 21600, 43200, 86400)

_INK, _FAINT = "#22262b", "#c9ced6"
POSITION_COLOR, VELOCITY_COLOR, _TRUE, _LEVEL, _ANALOG, _FRAME, _EVENT, _FAULT = (
    "#1f5fa8", "#c2570c", "#0f7b8a", "#2f7d55", "#6b4fa0", "#5b6470", "#22262b", "#b3261e",
)  # fmt: skip
STYLE = {
    "font.size": 8.5,
    "font.family": "DejaVu Sans",
    "text.color": _INK,
    "axes.labelcolor": _INK,
    "axes.edgecolor": _FAINT,
    "axes.linewidth": 0.8,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "svg.fonttype": "none",
    "svg.hashsalt": "steptwin",
}


class _PlotRow(NamedTuple):
    """A thin channel: levels of a pin, or marks."""

    label: str
    color: str
    pin: PinTrack | None
    moments: Sequence[Nanos] = ()


def write_plot(tracks: TraceTracks, file: IO[bytes], form: str, progress: TimeProgress) -> None:
    """``form`` is png or svg."""
    begin, until = tracks.begin, tracks.until
    moving = [track for track in tracks.axes if _moves(track, tracks)]
    axes = moving[:MOST_AXES]
    rows = _rows(tracks)
    left_out = len(moving) - len(axes), max(len(rows) - MOST_ROWS, 0)
    rows = rows[:MOST_ROWS]
    loads = [track.true() for track in axes]
    panels_each = [2 if load is None else 3 for load in loads]
    moved = [track for track in tracks.moved if _moves(track, tracks)][:MOST_AXES]
    heights = [_MOTION_IN] * (sum(panels_each) + len(moved)) + ([_ROW_IN * len(rows)] if rows else [])
    with rc_context(STYLE):
        labels = [_label(track, tracks) + " velocity" for track in axes] + [row.label for row in rows]
        labels += [_label(track, tracks) for track in moved]
        labels += [text for load in loads if load is not None for text in (f"{load.view.name} position", _GREY)]
        left = max(_LEFT_IN, _room(labels))
        figure, panels = _figure(tracks, heights, left)
        rest = iter(panels)
        for i, (track, load) in enumerate(zip(axes, loads, strict=True)):
            _motion(next(rest), next(rest), track, tracks)
            if load is not None:
                _true(next(rest), track, load, tracks)
            progress(begin + (until - begin) * (i + 1) // (len(axes) + 1))
        for track in moved:
            panel = next(rest)
            times, positions, _ = _points(track, tracks)
            panel.plot(*_thinned(times, positions), color=_TRUE, linewidth=1.1)
            _scale(panel, f"{_label(track, tracks)}\n{track.view.unit}", _TRUE)
        if rows:
            _channels(panels[-1], rows, tracks)
        if not panels:
            figure.text(left / _WIDTH_IN, 0.5, "nothing moved or changed", color=_FRAME)
        if any(left_out):
            note = f"not shown: {left_out[0]} axes, {left_out[1]} channels"
            figure.text(1 - _RIGHT_IN / _WIDTH_IN, 0.12 / figure.get_figheight(), note, ha="right", color=_FRAME)
        figure.savefig(file, format=form, dpi=150, metadata={"Date": None} if form == "svg" else {"Software": None})
    progress(until)


def _moves(track: AxisTrack, tracks: TraceTracks) -> bool:
    return len(track.loads) > 0 or any(
        profile_of(plan).moving(after) for plan, after, _ in track.intervals(tracks.begin, tracks.until)
    )


def _rows(tracks: TraceTracks) -> list[_PlotRow]:
    """Pins that changed, then links, events and faults."""
    one = len(tracks.controllers) == 1
    rows = [
        _PlotRow(pin.pin if one else pin.name, _ANALOG if pin.analog else _LEVEL, pin)
        for pin in tracks.pins
        if any(tracks.begin < time <= tracks.until for time in pin.times)
    ]
    marks: dict[tuple[str, str, str], list[Nanos]] = {}
    for record in tracks.marks:
        if record.kind in {"frame", "event", "fault"}:
            name = record.subject.partition("/")[0] if record.kind == "frame" else f"{record.kind}s"
            marks.setdefault((record.controller, name, record.kind), []).append(record.time)
    colors = {"frame": _FRAME, "event": _EVENT, "fault": _FAULT}
    for (controller, name, kind), moments in marks.items():
        rows.append(_PlotRow(name if one else f"{controller}.{name}", colors[kind], None, moments))
    return rows


def _room(labels: list[str]) -> float:
    """Inches that the longest label needs left of the panels."""
    font = FontProperties(family="DejaVu Sans", size=8.5)
    widest = max((TextPath((0, 0), label, prop=font).get_extents().width for label in labels), default=0.0)
    return _SCALE_IN + widest / 72 + _MARGIN_IN


def _label(track: AxisTrack, tracks: TraceTracks) -> str:
    return track.view.name if len(tracks.controllers) == 1 else track.name


def _figure(tracks: TraceTracks, heights: list[float], left: float) -> tuple[Figure, list[Axes]]:
    """One panel of each height (inches), one below the other, ``left`` inches from the edge."""
    height = _TOP_IN + _BOTTOM_IN + sum(heights) + _GAP_IN * max(len(heights) - 1, 0)
    figure = Figure(figsize=(_WIDTH_IN, max(height, 1.6)), facecolor="white")
    panels: list[Axes] = []
    at = height - _TOP_IN
    width = (_WIDTH_IN - left - _RIGHT_IN) / _WIDTH_IN
    for panel_height in heights:
        at -= panel_height
        panel = figure.add_axes((left / _WIDTH_IN, at / height, width, panel_height / height))
        _dress(panel, tracks)
        panels.append(panel)
        at -= _GAP_IN
    if panels:
        panels[-1].tick_params(axis="x", labelbottom=True, length=3)
        panels[-1].set_xlabel(_time_unit(tracks))
    names = ", ".join(tracks.controllers[:8]) + (" …" if len(tracks.controllers) > 8 else "")
    figure.text(left / _WIDTH_IN, 1 - 0.3 / max(height, 1.6), tracks.title or names, fontsize=11, fontweight="bold")
    return figure, panels


def _dress(panel: Axes, tracks: TraceTracks) -> None:
    panel.set_xlim(tracks.begin / SECOND, max(tracks.until, tracks.begin + 1) / SECOND)
    if _in_clock_time(tracks):
        span = (tracks.until - tracks.begin) / SECOND
        panel.xaxis.set_major_locator(MultipleLocator(next((s for s in _CLOCK_STEPS_S if 12 * s >= span), span)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda seconds, _: _clock(seconds)))
    else:
        panel.xaxis.set_major_locator(MaxNLocator(12, steps=[1, 2, 5, 10]))
    panel.tick_params(axis="x", labelbottom=False, length=0)
    panel.tick_params(axis="y", length=0, labelsize=7.5)
    panel.grid(axis="x", color=_FAINT, linewidth=0.5)
    panel.set_axisbelow(True)
    for side in ("top", "right", "left"):
        panel.spines[side].set_visible(False)


def _in_clock_time(tracks: TraceTracks) -> bool:
    return tracks.until - tracks.begin > 300 * SECOND


def _time_unit(tracks: TraceTracks) -> str:
    return "time (h:min:s)" if _in_clock_time(tracks) else "time (s)"


def _clock(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02}:{whole % 60:02}"


def _motion(above: Axes, below: Axes, track: AxisTrack, tracks: TraceTracks) -> None:
    view = track.view
    times, positions, velocities = _points(track.coordinate() or track, tracks)
    name = _label(track, tracks)
    for panel, values, color, label in (
        (above, positions, POSITION_COLOR, f"{name} position\n{view.unit}"),
        (below, velocities, VELOCITY_COLOR, f"{name} velocity\n{view.unit}/s"),
    ):
        panel.plot(*_thinned(times, values / view.pulses_per_unit), color=color, linewidth=1.1)
        _scale(panel, label, color)


def _true(panel: Axes, track: AxisTrack, load: AxisTrack, tracks: TraceTracks) -> None:
    """The position of the load, in front of the commanded one."""
    view = load.view
    mechanics = track.view.mechanics
    zero_p = 0 if mechanics is None else mechanics.zero_p
    times, commanded, _ = _points(track, tracks)
    panel.plot(*_thinned(times, (commanded + zero_p) / view.pulses_per_unit), color=_FAINT, linewidth=2.2)
    times, positions, _ = _points(load, tracks)
    panel.plot(*_thinned(times, positions / view.pulses_per_unit), color=_TRUE, linewidth=1.1)
    _scale(panel, f"{view.name} position\n{view.unit}\n{_GREY}", _TRUE)


def _points(track: AxisTrack, tracks: TraceTracks) -> tuple[Reals, Reals, Reals]:
    """Seconds, positions and velocities in pulses."""
    resolution = (tracks.until - tracks.begin) // _COLUMNS
    points = curve(track, tracks.begin, tracks.until, resolution)
    return np.array(points.times) / SECOND, np.array(points.positions), np.array(points.velocities)


def _scale(panel: Axes, label: str, color: str) -> None:
    panel.set_ylabel(label, rotation=0, ha="right", va="center", labelpad=36, color=color)
    panel.yaxis.set_label_coords(-_SCALE_IN / (panel.get_position().width * _WIDTH_IN), 0.5)
    panel.yaxis.set_major_locator(MaxNLocator(3))
    panel.margins(y=0.12)
    panel.grid(axis="y", color=_FAINT, linewidth=0.5)
    if not panel.dataLim.height:
        panel.set_ylim(panel.dataLim.y0 - 1, panel.dataLim.y0 + 1)


def _channels(panel: Axes, rows: list[_PlotRow], tracks: TraceTracks) -> None:
    panel.set_ylim(len(rows), 0)
    panel.set_yticks([i + 0.5 for i in range(len(rows))], [row.label for row in rows], fontsize=8)
    for i, row in enumerate(rows):
        panel.axhline(i + 0.86, color=_FAINT, linewidth=0.5, zorder=1)
        if row.pin is not None:
            times, levels, note = _levels(row.pin, tracks)
            times, levels = _thinned(times, levels)
            base, top = i + 0.86, i + 0.18
            drawn = base + (top - base) * levels
            panel.plot(times, drawn, color=row.color, linewidth=0.9, zorder=3)
            if not row.pin.analog:
                panel.fill_between(times, drawn, base, color=row.color, alpha=0.3, linewidth=0, zorder=2)
            panel.text(1.003, i + 0.5, note, transform=panel.get_yaxis_transform(), va="center", fontsize=6.5, color=row.color)
        else:
            seconds = np.array(row.moments) / SECOND
            shown = seconds[np.unique(np.round(seconds * (_COLUMNS / np.ptp(panel.get_xlim()))), return_index=True)[1]]
            ticks = [((second, i + 0.18), (second, i + 0.86)) for second in shown.tolist()]
            panel.add_collection(LineCollection(ticks, colors=row.color, linewidths=0.7, zorder=3), autolim=False)


def _levels(pin: PinTrack, tracks: TraceTracks) -> tuple[Reals, Reals, str]:
    """The corners of the curve of a pin, scaled to 0…1, and what 1 is if it is analog: its greatest value."""
    level = pin.level(tracks.begin)
    times, levels = [tracks.begin], [np.nan if level is None else level]
    for time, value in pin.changes(tracks.begin, tracks.until):
        times += [time, time]
        levels += [levels[-1], value]
    drawn = np.array([*levels, levels[-1]])
    note = ""
    if pin.analog:
        most = float(np.nanmax(np.abs(drawn))) or 1.0
        drawn = drawn / most
        note = f"max\n{most:.3g}"
    return np.array([*times, tracks.until]) / SECOND, drawn, note


def _thinned(times: Reals, values: Reals) -> tuple[Reals, Reals]:
    """In each column of pixels at most four points: the first, the lowest, the highest, the last."""
    if len(times) <= 4 * _COLUMNS:
        return times, values
    columns = ((times - times[0]) * (_COLUMNS / (times[-1] - times[0]))).astype(np.int64)
    firsts = np.flatnonzero(np.append(True, columns[1:] != columns[:-1]))
    lasts = np.append(firsts[1:], len(times)) - 1
    kept = np.empty((2, len(firsts), 4))
    kept[0] = times[firsts][:, None]
    kept[0, :, 3] = times[lasts]
    kept[1, :, 0], kept[1, :, 3] = values[firsts], values[lasts]
    kept[1, :, 1], kept[1, :, 2] = np.fmin.reduceat(values, firsts), np.fmax.reduceat(values, firsts)
    return kept[0].ravel(), kept[1].ravel()
