"""Common parts of the commands for devices: selection of the device, input and output of values and names."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Generator, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.errors import LineFailure, Misuse, Refusal

if TYPE_CHECKING:
    from steptwin.drivers import Mic488
    from steptwin.drivers.address import DeviceAddress
    from steptwin.drivers.m1486.identify import SearchLine

Device = Annotated[
    str | None,
    typer.Option(
        "--device",
        "-d",
        envvar="STEPTWIN_DEVICE",
        metavar="DEVICE",
        help="A running twin: mic488, machine.table (a controller of it) or its file machine.toml. A device: /dev/ttyUSB0, COM3, "
        "HOST:PORT, rtu-tcp://HOST:PORT, rfc2217://HOST:PORT. Behind it ,unit=N ,baud=N ,config=FILE ,firmware=V ,timeout=S; for "
        "an M1486 ,kind=m1486 or ,chip=7 ,variant=B. Default: the only running twin.",
        autocompletion=completion.devices,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
LogFrames = Annotated[bool, typer.Option("--log-frames", help="Print every frame in words to the standard error.")]
Axes = Annotated[list[str] | None, typer.Argument(metavar="AXES", help="1 to 4, or M1 to M4. Default: all.")]
REAL_LIMIT = 3.4e38
TIED = "expected AXIS=NUMBER, such as 1=12.5 or M1=12.5"


def find(device: str | None, *, whole_line: bool = False) -> DeviceAddress:
    """The device that ``--device`` names; `steptwin.live.twins.find_device`."""
    from steptwin.live.twins import find_device

    return find_device(device, whole_line=whole_line)


@contextlib.contextmanager
def opened(address: DeviceAddress, *, observe: bool = True, log_frames: bool = False) -> Generator[Mic488]:
    """A driver of the MIC488 there. ``observe``: DATA_TYPE is left as it is. Raises `Misuse` for another kind of device."""
    from steptwin.drivers import Mic488, NoAnswer

    if address.kind != "mic488":
        commands = "info, get, set, watch, home, seek, move, jog, stop, send and terminal"
        raise Misuse(f"this command is for the MIC488; for an M1486 there are {commands}")
    mic = Mic488(
        address.place,
        address.unit,
        baud=address.baud,
        firmware=address.firmware,
        config=address.config,
        timeout_s=address.timeout,
        observe=observe,
        log=complain if log_frames else None,
    )
    try:
        mic.open()
    except NoAnswer as error:
        drop_rubbish(address.place, address.baud)
        raise LineFailure(f"{error}. If these are M1486 chips, put ',kind=m1486' behind the address") from error
    try:
        yield mic
    finally:
        mic.close()


@contextlib.contextmanager
def search_line(place: str, baud: int) -> Generator[SearchLine]:
    """Open a line to search it for M1486 chips."""
    from steptwin.drivers.blocking import finish
    from steptwin.drivers.m1486.identify import SearchLine

    line = SearchLine(place, baud=baud)
    finish(line.open())
    try:
        yield line
    finally:
        finish(line.close())


def drop_rubbish(place: str, baud: int) -> None:
    """End the Modbus bytes on the line, so that M1486 chips on it, if any, read their next command correctly."""
    from steptwin.drivers.address import CHIP_BAUD
    from steptwin.drivers.blocking import finish
    from steptwin.drivers.m1486.identify import end_line

    for rate in (baud,) if "://" in place else (baud, CHIP_BAUD):
        with contextlib.suppress(LineFailure, Misuse), search_line(place, rate) as line:
            finish(end_line(line))


def complain(text: str) -> None:
    """Print a message to standard error."""
    print(text, file=sys.stderr, flush=True)  # noqa: T201


# ---------------------------------------------------------------------- what people type


def axis_of(text: str) -> int:
    """``1`` or ``M1``. Raises `Misuse`."""
    number = text.strip().upper().removeprefix("M")
    if number not in ("1", "2", "3", "4"):
        raise Misuse(f"{text!r} is not an axis: permitted are 1 to 4, or M1 to M4")
    return int(number)


def axes_of(texts: Sequence[str] | None) -> list[int]:
    return [axis_of(part) for text in texts or [] for part in text.split(",")]


def tied(texts: Sequence[str]) -> dict[int, float]:
    """``1=12.5 M2=-3`` as numbers by axis. Raises `Misuse`."""
    values: dict[int, float] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise Misuse(f"{text!r}: {TIED}")
        axis = axis_of(name)
        if axis in values:
            raise Misuse(f"{text!r}: M{axis} is given twice")
        values[axis] = number_of(value, text)
    return values


def number_of(value: str, whole: str) -> float:
    """A number with a point or a comma, or hexadecimal. Raises `Misuse`."""
    value = value.strip()
    try:
        return int(value, 16) if value.lower().startswith("0x") else float(value.replace(",", "."))
    except ValueError:
        raise Misuse(f"{whole!r}: {value!r} is not a number") from None


# ---------------------------------------------------------------------- what people read


class SuspensionDetector:
    """Detects that the command was suspended between two of its steps, so that no motion starts late."""

    LIMIT_S = 20.0
    """Longer than any step that comes before a motion: opening an E type takes about five seconds."""

    def __init__(self) -> None:
        self._at = time.monotonic()

    def check(self) -> None:
        """Immediately before a motion. Raises `Refusal` when too much time has passed since the last step."""
        away_s = time.monotonic() - self._at
        if away_s > self.LIMIT_S:
            raise Refusal(f"not moved: the command was suspended, or delayed by the line, for {away_s:.0f} s; repeat it")
        self._at = time.monotonic()


def print_started(names: Sequence[str]) -> None:
    """Print to a terminal that axes are moving and how to stop them."""
    if sys.stderr.isatty():
        typer.echo(f"{', '.join(names)} under way; Ctrl-C stops", err=True)


def shown(value: object) -> str:
    if isinstance(value, bool):
        return "ON" if value else "OFF"
    if not isinstance(value, float):
        return str(value)
    from steptwin.mic488.encoding import shortest_real

    return shortest_real(value)


def as_json(value: Any) -> Any:
    """Data for JSON: REAL values have the shortest form that reads back as the same REAL."""
    match value:
        case float() if isfinite(value):
            from steptwin.mic488.encoding import real_to_words, shortest_real, words_to_real

            is_real = abs(value) < REAL_LIMIT and words_to_real(*real_to_words(value)) == value
            return float(shortest_real(value)) if is_real else value
        case dict():
            return {key: as_json(one) for key, one in value.items()}
        case list() | tuple():
            return [as_json(one) for one in value]
        case _:
            return value


def table(rows: Sequence[Sequence[str]], head: Sequence[str] = ()) -> str:
    """A table with aligned columns; columns of numbers are right-aligned."""
    lines = [tuple(head), *map(tuple, rows)] if head else [tuple(row) for row in rows]
    if not lines:
        return ""
    columns = list(zip(*lines, strict=True))
    return aligned(lines, [n for n, column in enumerate(columns) if all(map(_is_number, column[bool(head) :]))])


def aligned(lines: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """A table with left-aligned columns, except those named (from 0), which are right-aligned."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    cells = [
        [cell.rjust(w) if n in right else cell.ljust(w) for n, (cell, w) in enumerate(zip(line, widths, strict=True))]
        for line in lines
    ]
    return "\n".join("  ".join(line).rstrip() for line in cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell in ("ON", "OFF")
    return True


def print_json(value: Any) -> None:
    import json

    typer.echo(json.dumps(as_json(value), ensure_ascii=False, indent=2))
