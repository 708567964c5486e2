"""A MIC488 at a terminal: registers by name, and requests as of a transcript. See
`steptwin.drivers.kind.DeviceTerminal`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager

from steptwin.drivers.mic488.named import map_of, read, writing
from steptwin.drivers.mic488.sync import Mic488
from steptwin.drivers.mic488.transcript import carry_out_one
from steptwin.drivers.typed import format_value

HELP = """\
NAME                read a register; also 'M?_ACC', USER_REGISTER[0-9], 10020, hr:10020:hex, several with blanks between
NAME=VALUE          write one
stop                stop all axes
wait AXIS...        until axes have come to rest
raw 03 27 24 00 02  send a PDU: function and data
help, quit"""


class Mic488Terminal:
    help = HELP

    def __init__(self, opened: AbstractContextManager[Mic488]) -> None:
        self._opened = opened
        self._mic = opened.__enter__()

    @property
    def greeting(self) -> str:
        mic = self._mic
        return f"{mic.place}, unit {mic.unit}, firmware {mic.firmware}; 'help' helps, Ctrl-D ends"

    @property
    def prompt(self) -> str:
        return f"{self._mic.unit}> "

    @property
    def names(self) -> Sequence[str]:
        return [register.name for register in map_of(self._mic)]

    def greet(self) -> None:
        """It is open."""

    def is_stop(self, line: str) -> bool:
        return line == "stop"

    def answer(self, line: str, *, waits: bool) -> Iterator[str]:
        line = line.partition("#")[0].strip()
        if not line:
            return
        if line == "stop":
            self._mic.stop_all()
        elif "=" in line:
            writing([line.removeprefix("set ")])(self._mic)
        elif line.split(maxsplit=1)[0] in ("wait", "raw", "sleep"):
            for name, result in carry_out_one(self._mic, line).items():
                yield f"{name}: {', '.join(map(format_value, result.values())) if isinstance(result, dict) else result}"
        else:
            for name, found in read(self._mic, line.removeprefix("get ").split()).items():
                yield f"{name} = {format_value(found.value)} {found.unit}".rstrip()

    def close(self) -> None:
        self._opened.__exit__(None, None, None)
