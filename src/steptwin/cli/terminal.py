"""``steptwin terminal``: talk to a controller line by line.

From Python: `steptwin.drivers.Mic488.get_shown` and `set`; `steptwin.drivers.m1486.terminal.ChipTerminal`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from steptwin.cli.device import Device, LogFrames, complain, find, kind_of, log_of, other_kinds_named
from steptwin.cli.typedlines import typed_lines
from steptwin.errors import Misuse, SteptwinError

if TYPE_CHECKING:
    from steptwin.drivers.kind import DeviceTerminal


def command(device: Device = None, log_frames: LogFrames = False) -> None:
    """Talk to a controller line by line: names read, NAME=VALUE writes. 'help' lists the rest. Lines may come from a pipe.

    An M1486 takes its own commands; what it sends is shown decoded.
    """
    address = find(device, whole_line=True)
    kind = kind_of(address)
    interactive = sys.stdin.isatty()

    def show(text: str) -> None:
        if not interactive:
            typer.echo(text)
            return
        import readline

        # It may arrive while a line is typed: it is printed above that line, which is redrawn.
        sys.stdout.write(f"\r\x1b[K{text}\n{opened.prompt}{readline.get_line_buffer()}")
        sys.stdout.flush()

    with other_kinds_named(kind, address):
        opened = kind.terminal(address, show, log_of(log_frames))
    try:
        if interactive:
            try:
                opened.greet()
            except SteptwinError as error:
                complain(str(error))
            complain(opened.greeting)
            _complete(opened.names)
        for line in typed_lines(lambda: opened.prompt, opened.is_stop):
            _answer(opened, line, interactive=interactive)
    finally:
        opened.close()


def _answer(opened: DeviceTerminal, line: str, *, interactive: bool) -> None:
    """Errors are reported; they end a script in a pipe."""
    try:
        for text in [opened.help] if line == "help" else opened.answer(line, waits=not interactive):
            typer.echo(text)
    except KeyboardInterrupt:
        complain("interrupted")
    except SteptwinError as error:
        complain(str(error))
        if not interactive:
            raise typer.Exit(2 if isinstance(error, Misuse) else 1) from None


def _complete(names: Sequence[str]) -> None:
    """Tab completes names, the arrows bring back lines."""
    with contextlib.suppress(ImportError):
        import readline

        def complete(begun: str, number: int) -> str | None:
            return next(iter([name for name in names if name.startswith(begun.upper())][number:]), None)

        readline.set_completer(complete)
        readline.set_completer_delims(" =")
        readline.parse_and_bind("tab: complete")
