"""Traces as files: JSON lines with all records, and formats of other programs.

| format | shows | needs |
|---|---|---|
| ``jsonl`` | every record, exactly; can be read back (`read_trace`) | |
| ``html`` | a timeline to look through in a browser | |
| ``png``, ``svg`` | a picture | matplotlib (extra ``plots``) |
| ``glb`` | the machine in space, in motion; for viewers of glTF | quickjs-ng (extra ``scene``) |
| ``vcd`` | what a logic analyser would have seen; for GTKWave | numpy (extra ``numbers``) |
| ``pcapng`` | the frames of lines; for Wireshark | |
| ``csv`` | samples of positions, velocities and levels | numpy (extra ``numbers``) |
| ``parquet`` | the same | pyarrow (extra ``parquet``) |
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, NamedTuple

from steptwin.calc import Calculation
from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.extras import lacking, missing
from steptwin.files.export.axes import axis_views, controller_views
from steptwin.files.export.progress import ShowExport, TimeProgress, bar, unwatched
from steptwin.files.export.records import SavedTrace, read_records, write_records
from steptwin.files.export.tracetracks import TraceTracks, sort_out
from steptwin.files.scene.recordedscene import RecordedScene
from steptwin.files.textfiles import check_writable, new_file
from steptwin.files.writing import as_text, is_written_directly
from steptwin.inputfiles import open_regular
from steptwin.simulation.mechanics.channels import AxisChannel, AxisViews
from steptwin.simulation.scheduler.trace import Trace, TraceRecord
from steptwin.wire.pcapng import CapturedFrame, capture

__all__ = [
    "FORMATS",
    "AxisChannel",
    "AxisViews",
    "SavedTrace",
    "axis_views",
    "bar",
    "check_target",
    "controller_views",
    "growing_file",
    "read_trace",
    "write_profile",
    "write_trace",
]

NAME = "trace"
"""The base name of files in a directory."""
NO_VIEWS: AxisViews = {}


class _Options(NamedTuple):
    period: Nanos
    progress: TimeProgress
    window: bool
    """Whether everything up to the end is shown."""
    texts: bool
    """Whether signals may be texts."""
    scene: RecordedScene | None


class Exporter(NamedTuple):
    """``needs`` are modules; ``extra`` is what installs them."""

    meaning: str
    extra: str
    write: Callable[[TraceTracks, IO[bytes], _Options], None] | None
    """None: written from the records themselves."""

    @property
    def is_available(self) -> bool:
        return not self.extra or not lacking(self.extra)


def _html(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    from steptwin.files.export.timeline import write_timeline

    with as_text(file) as text:
        write_timeline(tracks, text, options.progress, options.scene)


def _vcd(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    from steptwin.files.export.vcd import write_vcd

    write_vcd(tracks, file, options.progress, texts=options.texts)


def _pcapng(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    def captured(record: TraceRecord) -> CapturedFrame:
        options.progress(record.time)
        client, _, direction = record.subject.rpartition("/")
        return CapturedFrame(record.time, record.controller, client, direction == "in", record.data())

    file.writelines(capture(map(captured, tracks.of("frame"))))


def _csv(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    from steptwin.files.export.tables import write_csv

    with as_text(file) as text:
        write_csv(tracks, text, options.period, options.progress)


def _parquet(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    from steptwin.files.export.tables import write_parquet

    write_parquet(tracks, file, options.period, options.progress)


def _png(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    from steptwin.files.export.plot import write_plot

    write_plot(tracks if options.window else tracks.to_last_change(), file, "png", options.progress)


def _svg(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    from steptwin.files.export.plot import write_plot

    write_plot(tracks if options.window else tracks.to_last_change(), file, "svg", options.progress)


def _glb(tracks: TraceTracks, file: IO[bytes], options: _Options) -> None:
    from steptwin.files.scene.gltf import write_glb

    if options.scene is None:
        raise Misuse(
            "this trace has no machine in space: 'run' and 'replay' record it where elements have at, on or along (docs/space.md)"
        )
    write_glb(options.scene, file, tracks.begin, tracks.until)
    options.progress(tracks.until)


FORMATS: Mapping[str, Exporter] = {
    "jsonl": Exporter("every record, exactly", "", None),
    "html": Exporter("a timeline for the browser", "", _html),
    "png": Exporter("a picture", "plots", _png),
    "svg": Exporter("a picture", "plots", _svg),
    "glb": Exporter("the machine in space, in motion", "scene", _glb),
    "vcd": Exporter("signals for GTKWave", "numbers", _vcd),
    "pcapng": Exporter("frames for Wireshark", "", _pcapng),
    "csv": Exporter("samples", "numbers", _csv),
    "parquet": Exporter("samples", "parquet", _parquet),
}
USUAL = ("jsonl", "html", "png")
"""The formats written into a directory: small for any length of run. Those with missing libraries are left out."""


def write_trace(
    trace: Trace,
    where: Path | str,
    *,
    views: AxisViews = NO_VIEWS,
    scene: RecordedScene | None = None,
    title: str = "",
    ended: Nanos | None = None,
    formats: Sequence[str] | None = None,
    begin: Nanos = 0,
    until: Nanos | None = None,
    controllers: Collection[str] | None = None,
    period: Nanos = MILLISECOND,
    texts: bool = True,
    watch: ShowExport = unwatched,
) -> list[Path]:
    """Write ``trace`` to a file, whose suffix selects its format, or into a directory, as ``trace.jsonl`` and so on; what was
    written. A pipe or device without a suffix gets JSON lines.

    ``views`` (`axis_views`) give units of axes, names of their terminals, and mechanics. ``scene`` is the machine in space, where
    it has been recorded (`steptwin.files.scene.recorder`). ``title`` is the name of what ran, and
    ``ended`` (ns) when that ended; by default when all came to rest. ``formats``: by default `USUAL` for a directory,
    otherwise that of the file's suffix. A window of time (``begin`` to ``until``, ns) and ``controllers`` limit what is
    shown; JSON lines always have everything. Without ``until`` everything goes on to the end, but pictures end shortly after
    the last change. ``period`` (ns) is that of samples. Without ``texts`` a VCD has no signals of type
    string (events, frames, faults), which sigrok does not read. ``watch=bar`` shows on a terminal how far each file is.

    Raises `Misuse` for what is not permitted, for libraries that are missing, and where a file cannot be written; a file is
    there as a whole or, after an error, as it was before.
    """
    where = Path(where)
    targets = _targets(where, formats)
    if period < 1:
        raise Misuse(f"period = {period} ns: must be 1 ns or more")
    if len(trace) and next(iter(trace), None) is None:
        raise Misuse("this trace has kept nothing but its digest: there is nothing to write")
    tracks = replace(sort_out(trace, views, begin, ended if until is None else until, controllers), title=title)
    ended = tracks.until if ended is None else ended
    for name, path in targets:
        write = FORMATS[name].write
        with new_file(path) as file, watch(path.name, tracks.begin, tracks.until) as progress:
            if write is None:
                with as_text(file) as text:
                    write_records(trace, views, text, progress, title=title, until=ended, scene=scene)
            else:
                write(tracks, file, _Options(period, progress, until is not None, texts, scene))
    return [path for _, path in targets]


PICTURES = ("png", "svg")


def write_profile(result: Calculation, where: Path | str) -> None:
    """Write a picture of a calculated move; the suffix selects png or svg. Raises `Misuse`."""
    where = Path(where)
    form = where.suffix[1:].lower()
    if form not in PICTURES:
        raise Misuse(f"cannot write {where}: pictures are {', '.join(f'.{one}' for one in PICTURES)}")
    _check(form)
    check_writable(where)
    from steptwin.files.export.profileplot import write_profile_plot

    with new_file(where) as file:
        write_profile_plot(result, file, form)


def check_target(where: Path | str) -> None:
    """Check in advance that `write_trace` can write there. Raises `Misuse`."""
    for _, path in _targets(Path(where), None):
        check_writable(path)


def growing_file(where: Path) -> Path:
    """The JSON lines that are written while a world runs, when `write_trace` is to make ``where`` of them in the end."""
    name, path = _targets(where, None)[0]
    if name == "jsonl":
        return path
    return path.with_name(f".{path.name}.jsonl")


def _targets(where: Path, formats: Sequence[str] | None) -> list[tuple[str, Path]]:
    """Formats and files. All of them can be written as far as libraries go."""
    suffix = where.suffix[1:].lower()
    if is_written_directly(where):
        is_file, suffix = True, suffix if suffix in FORMATS else "jsonl"
    else:
        is_file = not where.is_dir() and (suffix in FORMATS or (suffix != "" and formats is not None and len(formats) == 1))
    if suffix and not is_file and not where.is_dir() and formats is None:
        raise Misuse(f"{where}: formats are {', '.join(FORMATS)}")
    chosen = formats or ([suffix] if is_file else [name for name in USUAL if FORMATS[name].is_available])
    for name in chosen:
        _check(name)
    if is_file:
        if len(chosen) > 1:
            raise Misuse(f"{where}: one file cannot be {' and '.join(chosen)}; name a directory")
        return [(chosen[0], where)]
    return [(name, where / f"{NAME}.{name}") for name in dict.fromkeys(chosen)]


def _check(name: str) -> None:
    """`Misuse` unless there is such a format and its libraries are there."""
    found = FORMATS.get(name)
    if found is None:
        raise Misuse(f"no format {name!r}: formats are {', '.join(FORMATS)}")
    if not found.is_available:
        raise missing(name, found.extra)


def read_trace(where: Path | str) -> SavedTrace:
    """Read JSON lines of `write_trace`: a file, or a directory with ``trace.jsonl``.

    Raises `Misuse` if it cannot be read, is not a trace, or was changed (its digest is checked).
    """
    path = Path(where)
    if path.is_dir():
        path /= f"{NAME}.jsonl"
    with open_regular(path) as file:
        return read_records(file, str(path))
