"""Common parts of the commands for devices and twins: selection of the device, input and output of values and names."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Generator, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.columns import aligned
from steptwin.errors import LineFailure, Refusal

if TYPE_CHECKING:
    from steptwin.drivers.kind import AnyDriverKind, DeviceAddress, ReadValues

Device = Annotated[
    str | None,
    typer.Option(
        "--device",
        "-d",
        envvar="STEPTWIN_DEVICE",
        metavar="DEVICE",
        help="A running twin: mic488, machine.table (a controller of it) or its file machine.toml. A device: /dev/ttyUSB0, COM3, "
        "HOST:PORT, rtu-tcp://HOST:PORT, rfc2217://HOST:PORT, tls://HOST:PORT?…. "
        "Behind it ,unit=N ,baud=N ,config=FILE ,firmware=V ,timeout=S; for "
        "an M1486 ,kind=m1486 or ,chip=7 ,variant=B. Default: the only running twin.",
        autocompletion=completion.devices,
    ),
]
Twin = Annotated[
    str | None,
    typer.Option(
        "--device",
        "-d",
        metavar="TWIN",
        help="A running twin: mic488, machine.table (a controller of it), its file or address. Default: the only one running.",
        autocompletion=completion.devices,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
LogFrames = Annotated[bool, typer.Option("--log-frames", help="Print every frame in words to the standard error.")]
Axes = Annotated[list[str] | None, typer.Argument(metavar="AXES", help="1 or M1, 2 or M2, … Default: all.")]
REAL_LIMIT = 3.4e38


def find(device: str | None, *, whole_line: bool = False) -> DeviceAddress:
    """The device that ``--device`` names; `steptwin.live.twins.find_device`."""
    from steptwin.live.twins import find_device

    return find_device(device, whole_line=whole_line)


def kind_of(address: DeviceAddress) -> AnyDriverKind:
    """Kind of the device."""
    from steptwin.drivers.kinds import DRIVERS

    return DRIVERS[address.kind]


@contextlib.contextmanager
def opened(address: DeviceAddress, *, observe: bool = True, log_frames: bool = False) -> Generator[Any]:
    """A driver of the device there. ``observe``: settings are left as they are."""
    kind = kind_of(address)
    with contextlib.ExitStack() as stack:
        with other_kinds_named(kind, address):
            driver = stack.enter_context(kind.opened(address, observe, log_of(log_frames)))
        yield driver


@contextlib.contextmanager
def other_kinds_named(kind: AnyDriverKind, address: DeviceAddress) -> Generator[None]:
    """If the device does not answer, name other kinds that it may be, and end what they have received."""
    from steptwin.drivers import NoAnswer
    from steptwin.drivers.kinds import clear_line, others_there

    try:
        yield
    except NoAnswer as error:
        clear_line(kind, address.place, address.baud)
        raise LineFailure(f"{error}{others_there(kind)}") from error


def log_of(log_frames: bool) -> Callable[[str], object] | None:
    return complain if log_frames else None


def complain(text: str) -> None:
    """Print a message to standard error."""
    print(text, file=sys.stderr, flush=True)  # noqa: T201


# ---------------------------------------------------------------------- what people type


def axes_of(texts: Sequence[str] | None, kind: AnyDriverKind) -> list[int]:
    """``1 M2`` or ``1,2``; none: an empty list. Raises `Misuse`."""
    from steptwin.drivers.typed import axis_of

    return [axis_of(part, kind.axes) for text in texts or [] for part in text.split(",")]


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


def format_value(value: object) -> str:
    from steptwin.drivers import typed

    return typed.format_value(value)


def values_table(values: ReadValues) -> str:
    """Names, values, and their units or meanings."""
    return table([(name, format_value(one.value), one.unit or one.meaning) for name, one in values.items()])


def values_data(values: ReadValues) -> dict[str, Any]:
    """For JSON: ``value``, and where there is one ``unit`` or ``meaning``."""
    return {
        name: {
            "value": one.value,
            **({"unit": one.unit} if one.unit else {}),
            **({"meaning": one.meaning} if one.meaning else {}),
        }
        for name, one in values.items()
    }


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
    return "\n".join(aligned(lines, [n for n, column in enumerate(columns) if all(map(_is_number, column[bool(head) :]))]))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell in ("ON", "OFF")
    return True


def print_json(value: Any) -> None:
    import json

    typer.echo(json.dumps(as_json(value), ensure_ascii=False, indent=2))
