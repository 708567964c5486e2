"""``steptwin watch``: registers again and again, until Ctrl-C.

From Python: `steptwin.drivers.Mic488.get_shown` in a loop.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.cli.device import Device, LogFrames, as_json, find, format_value, kind_of, opened, table
from steptwin.errors import Misuse

Look = Callable[[], dict[str, tuple[Any, str]]]
MOST_HZ = 50.0
LEAST_WIDTH = 10
"""Width of a column: as wide as most values."""


def command(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME", help="As of get. Default: what the axes do.", autocompletion=completion.values),
    ] = None,
    device: Device = None,
    hz: Annotated[float, typer.Option(help="Samples per second, up to 50; the device may be slower.")] = 5.0,
    count: Annotated[int | None, typer.Option(help="Stop after N samples.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print a line of JSON for each sample.")] = False,
    log_frames: LogFrames = False,
) -> None:
    """Read registers again and again. In a terminal a live table, else a line of aligned columns for each sample."""
    if not 0.0 < hz <= MOST_HZ:
        raise Misuse(f"--hz {hz:g}: permitted are more than 0 and at most {MOST_HZ:g}")
    if count is not None and count < 1:
        raise Misuse(f"--count {count}: permitted are 1 and more")
    with _reading(device, names, log_frames=log_frames) as look:
        looks = _looks(look, hz, count)
        try:
            if json:
                _print_json(looks)
            elif sys.stdout.isatty():
                _draw(looks)
            else:
                _print_lines(looks)
        except KeyboardInterrupt:
            pass


@contextlib.contextmanager
def _reading(device: str | None, names: list[str] | None, *, log_frames: bool) -> Generator[Look]:
    """A function that reads the values once. A twin is not polled; what is no point of it is read over its line."""
    from steptwin.drivers.kinds import DRIVERS
    from steptwin.live.remote import RemoteSubject
    from steptwin.live.twins import controller_of
    from steptwin.live.watching import TwinWatch

    twin = None if log_frames else controller_of(device)
    if twin is not None and twin.kind in DRIVERS:
        with RemoteSubject(twin.twin) as subject:
            points = DRIVERS[twin.kind].followed(names or (), twin.type)
            if points is not None:
                yield TwinWatch(subject, twin.name, points).look
                return
    address = find(device)
    kind = kind_of(address)
    read = kind.reading(names or kind.usual)
    with opened(address, log_frames=log_frames) as driver:
        yield lambda: {name: (one.value, one.unit) for name, one in read(driver).items()}


def _looks(look: Look, hz: float, count: int | None) -> Iterator[tuple[float, dict[str, tuple[Any, str]]]]:
    """Seconds since the first look, and the values."""
    begin = time.monotonic()
    number = 0
    while count is None or number < count:
        yield time.monotonic() - begin, look()
        number += 1
        # A look that is late is left out, so that a slow line is not asked without a pause.
        number_due = (time.monotonic() - begin) * hz
        if count is None or number < count:
            time.sleep((1.0 - number_due % 1.0) / hz)


def _print_json(looks: Iterator[tuple[float, dict[str, tuple[Any, str]]]]) -> None:
    import json

    for at, values in looks:
        typer.echo(json.dumps(as_json({"time_s": round(at, 3)} | {name: value for name, (value, _) in values.items()})))


def _print_lines(looks: Iterator[tuple[float, dict[str, tuple[Any, str]]]]) -> None:
    widths: list[int] = []
    for at, values in looks:
        if not widths:
            heads = ["time_s", *(f"{name} {unit}".rstrip() for name, (_, unit) in values.items())]
            widths = [max(len(head), LEAST_WIDTH) for head in heads]
            typer.echo(_line(heads, widths))
        typer.echo(_line([f"{at:.3f}", *(_text(value) for value, _ in values.values())], widths))


def _text(value: Any) -> str:
    return "unknown" if value is None else format_value(value)


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    return "  ".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))


def _draw(looks: Iterator[tuple[float, dict[str, tuple[Any, str]]]]) -> None:
    from rich.live import Live
    from rich.text import Text

    with Live(auto_refresh=False) as live:
        for at, values in looks:
            rows = [(name, _text(value), unit) for name, (value, unit) in values.items()]
            live.update(Text(f"{table(rows)}\n{at:.1f} s, Ctrl-C ends", no_wrap=True), refresh=True)
