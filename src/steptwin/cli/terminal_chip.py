"""``steptwin terminal`` for the M1486: its one-letter commands, as the manual has them.

From Python: `steptwin.runtime.m1486_terminal.ChipTerminal`.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

import typer

from steptwin.cli.device import complain, number_of
from steptwin.errors import Misuse, Refusal, SteptwinError

if TYPE_CHECKING:
    from steptwin.host.address import DeviceAddress
    from steptwin.m1486.variants import Variant
    from steptwin.runtime.m1486_terminal import ChipTerminal

HELP = """\
COMMAND             as the manual has it: x7, v2000, f12800, r, u1, t41, [ … ; k stops at once
raw TEXT            typed as it is; a command is looked at first, and wrong data are not sent
wait [SECONDS]      until the chips have done all they were told: types u20 and waits for the answer, 60 s
sleep SECONDS
help, quit"""
WAIT_S = 60.0


def chip_terminal(address: DeviceAddress, *, log_frames: bool) -> None:
    """Lines from the standard input to the chips. A script in a pipe ends with the first thing that goes wrong."""
    from steptwin.host.m1486.lines import line_endpoint
    from steptwin.m1486.variants import variant
    from steptwin.runtime.m1486_terminal import ChipTerminal

    kind = None if address.variant is None else variant(address.variant)
    endpoint = line_endpoint(address.place, address.baud)
    interactive = sys.stdin.isatty()
    prompt = ""

    def tell(text: str) -> None:
        if not interactive:
            typer.echo(text)
            return
        import readline

        # It comes while somebody types: above his line, which is written anew.
        sys.stdout.write(f"\r\x1b[K{text}\n{prompt}{readline.get_line_buffer()}")
        sys.stdout.flush()

    terminal = ChipTerminal(endpoint.open(), address.baud, kind, tell)
    try:
        if address.chip is not None:
            _type(terminal, f"x{address.chip:x}", log_frames=log_frames)
        if interactive:
            complain(f"M1486 on {endpoint}; 'help' helps, k stops the motor, Ctrl-D ends")
        while True:
            prompt = f"{terminal.selected or 'all'}> " if interactive else ""
            try:
                line = input(prompt).strip()
            except (EOFError, KeyboardInterrupt):
                break
            if line in ("quit", "exit"):
                break
            try:
                _answer(terminal, line, kind, log_frames=log_frames, waits=not interactive)
            except KeyboardInterrupt:
                complain("interrupted")
            except SteptwinError as error:
                complain(str(error))
                if not interactive:
                    raise typer.Exit(2 if isinstance(error, Misuse) else 1) from None
    finally:
        terminal.close()


def _answer(terminal: ChipTerminal, line: str, kind: Variant | None, *, log_frames: bool, waits: bool) -> None:
    word, _, rest = line.partition(" ")
    if word == "help":
        typer.echo(HELP)
    elif word == "sleep":
        time.sleep(_seconds(rest, line))
    elif word == "wait":
        _type(terminal, "u20", log_frames=log_frames)
        terminal.settle(_seconds(rest, line) if rest.strip() else WAIT_S)
    elif word == "raw":
        _typed(terminal, rest, log_frames=log_frames, waits=waits)
    elif line:
        from steptwin.runtime.m1486_terminal import command_of

        if command_of(line, kind) is not None:
            _typed(terminal, line.partition(";")[0].strip(), log_frames=log_frames, waits=waits)


def _typed(terminal: ChipTerminal, text: str, *, log_frames: bool, waits: bool) -> None:
    _type(terminal, text, log_frames=log_frames)
    if waits and terminal.settle(WAIT_S):
        raise Refusal(f"{text!r} found no room (5EH): the chip moves, waits or is held. 'wait' before it waits for that")


def _type(terminal: ChipTerminal, text: str, *, log_frames: bool) -> None:
    if log_frames:
        complain(f"→ {text} CR")
    terminal.type(text)


def _seconds(text: str, line: str) -> float:
    seconds = number_of(text, line)
    if not 0.0 <= seconds <= 3600.0:
        raise Misuse(f"{line!r}: permitted are 0 to 3600 s")
    return seconds
