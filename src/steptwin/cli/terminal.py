"""``steptwin terminal``: talk to a controller line by line.

From Python: `steptwin.drivers.Mic488.get_shown` and `set`. An M1486's is `steptwin.cli.terminal_chip`.
"""

from __future__ import annotations

import contextlib
import sys
from typing import TYPE_CHECKING

import typer

from steptwin.cli.device import Device, LogFrames, complain, find, opened, shown
from steptwin.cli.terminal_chip import chip_terminal
from steptwin.cli.typedlines import typed_lines
from steptwin.errors import Misuse, SteptwinError

if TYPE_CHECKING:
    from steptwin.drivers import Mic488

HELP = """\
NAME                read a register; also 'M?_ACC', USER_REGISTER[0-9], 10020, hr:10020:hex, several with blanks between
NAME=VALUE          write one
stop                stop all axes
wait AXIS...        until axes have come to rest
raw 03 27 24 00 02  send a PDU: function and data
help, quit"""


def terminal(device: Device = None, log_frames: LogFrames = False) -> None:
    """Talk to a controller line by line: names read, NAME=VALUE writes. 'help' lists the rest. Lines may come from a pipe.

    An M1486 takes its own commands; what it sends is shown decoded.
    """
    address = find(device, whole_line=True)
    if address.kind == "m1486":
        chip_terminal(address, log_frames=log_frames)
        return
    with opened(address, log_frames=log_frames) as mic:
        interactive = sys.stdin.isatty()
        if interactive:
            complain(f"{mic.place}, unit {mic.unit}, firmware {mic.firmware}; 'help' helps, Ctrl-D ends")
            _complete(mic)
        for line in typed_lines(lambda: f"{mic.unit}> ", lambda line: line == "stop"):
            try:
                _answer(mic, line.partition("#")[0].strip())
            except SteptwinError as error:
                complain(str(error))
                if not interactive:
                    raise typer.Exit(2 if isinstance(error, Misuse) else 1) from None


def _answer(mic: Mic488, line: str) -> None:
    from steptwin.cli.get import expanded, look, map_of, value_of
    from steptwin.commands.devicesession import carry_out_one

    if not line:
        return
    if line == "help":
        typer.echo(HELP)
    elif line == "stop":
        mic.stop_all()
    elif "=" in line:
        name, _, value = line.removeprefix("set ").partition("=")
        name = name.strip()
        mic.set(name, value_of(map_of(mic).named(name.partition("[")[0]), value.strip(), line))
    elif line.split(maxsplit=1)[0] in ("wait", "raw", "sleep"):
        for name, result in carry_out_one(mic, line).items():
            typer.echo(f"{name}: {', '.join(map(shown, result.values())) if isinstance(result, dict) else result}")
    else:
        names = expanded(map_of(mic), line.removeprefix("get ").split())
        for name, (value, unit) in look(mic, names).items():
            typer.echo(f"{name} = {shown(value)} {unit}".rstrip())


def _complete(mic: Mic488) -> None:
    """Tab completes names of registers, the arrows bring back lines."""
    with contextlib.suppress(ImportError):
        import readline

        from steptwin.cli.get import map_of

        names = [register.name for register in map_of(mic)]

        def complete(begun: str, number: int) -> str | None:
            return next(iter([name for name in names if name.startswith(begun.upper())][number:]), None)

        readline.set_completer(complete)
        readline.set_completer_delims(" =")
        readline.parse_and_bind("tab: complete")
