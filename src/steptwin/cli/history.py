"""``steptwin history``: what has been kept of twins and devices.

From Python: `steptwin.history.HistoryDatabase`.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from steptwin.cli.device import Json
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse


def command(
    database: Annotated[str, typer.Argument(metavar="DATABASE", help="FILE.db, sqlite:///FILE.db or postgresql://HOST/NAME.")],
    points: Annotated[
        list[str] | None, typer.Argument(metavar="[POINT]...", help="Such as table.M1.position or 'table.pins.*'.")
    ] = None,
    run: Annotated[int | None, typer.Option(help="Only this run; -1 is the last one.")] = None,
    begin: Annotated[
        str | None,
        typer.Option("--from", metavar="TIME", help="A date, or a time since the begin of the run: '2026-03-01 14:30', '10 s'."),
    ] = None,
    end: Annotated[str | None, typer.Option("--to", metavar="TIME", help="As --from.")] = None,
    every: Annotated[
        str | None, typer.Option(metavar="TIME", help="Show a value at this interval. Default: every recorded one.")
    ] = None,
    other: Annotated[
        int | None, typer.Option("--with", metavar="RUN", help="Compare with this run. Exit code 1: they differ.")
    ] = None,
    events: Annotated[bool, typer.Option("--events", help="Show events instead of values.")] = False,
    writes: Annotated[
        bool, typer.Option("--writes", help="Show what programs have written and commanded, and who they are.")
    ] = False,
    output: Annotated[
        Path | None, written("--output", "-o", help="Write a file: .csv, .parquet, or a picture, .png or .svg.")
    ] = None,
    json: Json = False,
) -> None:
    """Show, export and compare what a database has kept of twins and devices.

    Without points: runs, and the points that there are. Dates are local time unless they have an offset.
    """
    options = HistoryOptions(
        points=tuple(points or ()),
        run=run,
        other=other,
        begin=begin,
        end=end,
        every=every,
        output=output,
        events=events,
        writes=writes,
        as_json=json,
    )
    if not _show(database, options, typer.echo):
        raise typer.Exit(1)


FORMATS = {".csv": "numbers", ".parquet": "parquet", ".png": "plots", ".svg": "plots"}
"""The extra that each needs."""
MOST_LINES = 1000
HEAD = ("run", "time", "seconds", "point", "value", "unit")


@dataclass(frozen=True, slots=True, kw_only=True)
class HistoryOptions:
    points: Sequence[str]
    run: int | None
    other: int | None
    """The run to compare with."""
    begin: str | None
    end: str | None
    every: str | None
    output: Path | None
    events: bool
    writes: bool
    as_json: bool


def _show(database: str, options: HistoryOptions, out: Callable[[str], object]) -> bool:
    """Print or export; whether a comparison found no difference. Raises `Misuse`, `LineFailure`."""
    from steptwin.extras import missing

    try:
        from steptwin.history.reading import HistoryDatabase
    except ImportError:
        raise missing("steptwin history", "history") from None
    if options.output is not None:
        _check_output(options.output, options.points)
    with HistoryDatabase(database if "://" in database else f"sqlite:///{database}") as past:
        return _Shown(past, options, out).show()


def _check_output(path: Path, points: Sequence[str]) -> None:
    from steptwin.extras import lacking, missing
    from steptwin.files.textfiles import check_writable

    need = FORMATS.get(path.suffix)
    if need is None:
        raise Misuse(f"--output {path}: permitted are {', '.join(f'NAME{suffix}' for suffix in FORMATS)}")
    if not points:
        raise Misuse(f"--output {path}: name the points to write")
    if lacking(need):
        raise missing(path.suffix, need)
    check_writable(path)


class _Shown:
    def __init__(self, past: Any, options: HistoryOptions, out: Callable[[str], object]) -> None:
        from steptwin.controller import SECOND
        from steptwin.durations import duration
        from steptwin.history.intervals import read_interval

        self._past = past
        self._options = options
        self._out = out
        self._every = None if options.every is None else duration(options.every) / SECOND
        if self._every == 0:
            raise Misuse(f"--every {options.every}: must be more than 0")
        is_open = not past.runs()
        self._interval = None if is_open else read_interval(past, options.run, options.begin, options.end)

    def show(self) -> bool:
        options = self._options
        if self._interval is None:
            self._out(f"{self._past.address}: nothing has been kept yet")
            return True
        if options.events or options.writes:
            from steptwin.history.reading import WRITTEN

            self._events(WRITTEN if options.writes else None)
            return True
        if not options.points:
            self._overview()
            return True
        points = self._points()
        if options.other is not None:
            return self._compare(points)
        if options.output is not None:
            self._export(options.output, [self._series(point) for point in points])
            return True
        self._values([self._series(point) for point in points])
        return True

    def _points(self) -> list[str]:
        """Their names; patterns give all that they fit."""
        found: list[str] = []
        for wanted in self._options.points:
            if not set(wanted) & set("*?["):
                found.append(wanted)
                continue
            fitting = [point.name for point in self._past.points(wanted)]
            if not fitting:
                raise Misuse(f"no point fits {wanted!r}: 'steptwin history DATABASE' lists them")
            found += fitting
        return list(dict.fromkeys(found))

    def _series(self, point: str) -> Any:
        interval = self._interval
        assert interval is not None  # noqa: S101
        return self._past.series(point, interval.begin, interval.end, every_s=self._every, run=interval.number)

    # ------------------------------------------------------------------ as text

    def _overview(self) -> None:
        from steptwin.controller import SECOND

        runs, points = self._past.runs(), self._past.points()
        if self._options.as_json:
            listed = [
                {
                    "run": run.number,
                    "subject": run.subject,
                    "began": run.began.isoformat(),
                    "ended": run.ended.isoformat(),
                    "seconds": (run.ended_ns - run.began_ns) / SECOND,
                    "virtual": run.is_virtual,
                    "over": run.is_over,
                }
                for run in runs
            ]
            names = [point._asdict() for point in points]
            self._out(json.dumps({"runs": listed, "points": names, "rows": self._past.counts()}, ensure_ascii=False, indent=2))
            return
        self._out(self._past.address)
        for run in runs:
            length = (run.ended_ns - run.began_ns) / SECOND
            state = "" if run.is_over else "  goes on, or was cut off"
            kind = "virtual s" if run.is_virtual else "s"
            self._out(f"  run {run.number:<4} {_local(run.began)}  {length:12.3f} {kind:<9} {run.subject}{state}")
        counts = ", ".join(f"{count} {name}" for name, count in self._past.counts().items())
        self._out(f"  {counts}")
        for name, units in _grouped(points).items():
            self._out(f"  {name}: {', '.join(units)}")

    def _events(self, kinds: Sequence[str] | None) -> None:
        from steptwin.controller import SECOND

        interval = self._interval
        assert interval is not None  # noqa: S101
        found = self._past.events(interval.begin, interval.end, run=interval.number, kinds=kinds, most=MOST_LINES)
        if self._options.as_json:
            data = [{**event._asdict(), "at": event.at.isoformat(), "time": str(event.time)} for event in found]
            self._out(json.dumps(data, ensure_ascii=False, indent=2))
            return
        for event in found:
            self._out(f"{_local(event.at)}  {event.time / SECOND:12.6f} s  {event.machine:<10} {event.text}".rstrip())

    def _values(self, found: Sequence[Any]) -> None:
        rows = sorted(_rows(found), key=lambda row: (row[1], row[0]))
        if self._options.as_json:
            self._out(json.dumps([dict(zip(HEAD, _to_json(row), strict=True)) for row in rows], ensure_ascii=False, indent=2))
            return
        for run, at, seconds, point, value, unit in rows[:MOST_LINES]:
            self._out(f"{_local(at)}  run {run}  {seconds:12.6f} s  {point}  {_text(value, unit)}")
        if len(rows) > MOST_LINES:
            self._out(f"... and {len(rows) - MOST_LINES} more: choose a shorter interval, or write them to a file with --output")

    def _compare(self, points: Sequence[str]) -> bool:
        from steptwin.history.intervals import compare, read_interval

        options, interval = self._options, self._interval
        assert interval is not None  # noqa: S101
        if interval.run is None:
            interval = read_interval(self._past, -1, options.begin, options.end)
        other = read_interval(self._past, options.other, options.begin, options.end)
        if options.output is not None:
            self._export_pairs(options.output, points, interval, other)
        found = compare(self._past, points, interval, other, self._every)
        if options.as_json:
            data = [{**one._asdict(), "most": _finite(one.most), "values": list(map(_finite, one.values))} for one in found]
            self._out(json.dumps(data, ensure_ascii=False, indent=2))
        for one in () if options.as_json else found:
            apart = "differs" if one.most == float("inf") else f"{one.most:g} {one.unit}".rstrip() + " apart"
            values = " and ".join(map(_text, one.values))
            self._out(f"{one.point}: {apart} {one.at_s:g} s after the begin: {values}")
        if not found and not options.as_json:
            self._out(f"{len(points)} {'point is' if len(points) == 1 else 'points are'} alike")
        return not found

    # ------------------------------------------------------------------ as files

    def _export(self, path: Path, found: Sequence[Any]) -> None:
        from steptwin.files.textfiles import new_file
        from steptwin.files.writing import as_text

        with new_file(path) as file:
            if path.suffix == ".csv":
                with as_text(file) as text:
                    writer = csv.writer(text, lineterminator="\n")
                    writer.writerow(HEAD)
                    writer.writerows(_to_json(row) for row in _rows(found))
            elif path.suffix == ".parquet":
                from steptwin.history.parquet import write_parquet

                write_parquet(found, file)
            else:
                from steptwin.history.picture import draw

                draw({series.point: [series] for series in found}, file, path.suffix[1:])
        self._out(f"{path}: {sum(map(len, found))} values of {len(found)} points")

    def _export_pairs(self, path: Path, points: Iterable[str], one: Any, other: Any) -> None:
        from steptwin.files.textfiles import new_file

        pairs = {
            point: [self._past.series(point, part.begin, part.end, every_s=self._every, run=part.number) for part in (one, other)]
            for point in points
        }
        if path.suffix in {".png", ".svg"}:
            from steptwin.history.picture import draw

            with new_file(path) as file:
                draw(pairs, file, path.suffix[1:])
            self._out(f"{path}: runs {one.number} (blue) and {other.number} (orange)")
        else:
            self._export(path, [series for pair in pairs.values() for series in pair])


def _grouped(points: Iterable[Any]) -> dict[str, list[str]]:
    """The names of points by controller and group."""
    found: dict[str, list[str]] = {}
    for point in points:
        group, _, name = point.name.rpartition(".")
        found.setdefault(group, []).append(f"{name} [{point.unit}]" if point.unit else name)
    return found


def _rows(found: Iterable[Any]) -> Iterable[tuple[Any, ...]]:
    for series in found:
        for run, at, seconds, value in zip(series.runs, series.at, series.seconds, series.values, strict=True):
            yield int(run), at, float(seconds), series.point, value, series.unit


def _to_json(row: tuple[Any, ...]) -> tuple[Any, ...]:
    run, at, seconds, point, value, unit = row
    return run, f"{at}Z", seconds, point, _finite(value), unit


def _finite(value: Any) -> Any:
    """As JSON and CSV have values: None where it is not known."""
    if value is None or isinstance(value, str):
        return value
    number = float(value)
    return number if abs(number) < float("inf") else None


def _text(value: Any, unit: str = "") -> str:
    found = _finite(value)
    if found is None:
        return "not known"
    return found if isinstance(found, str) else f"{found:g} {unit}".rstrip()


def _local(at: Any) -> str:
    """Local time with its offset."""
    moment = at if isinstance(at, datetime) else datetime.fromisoformat(f"{at}+00:00")
    return moment.astimezone().isoformat(sep=" ", timespec="milliseconds")
