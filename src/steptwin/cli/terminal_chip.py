"""``steptwin terminal`` for the M1486: its one-letter commands, as the manual has them.

From Python: `steptwin.commands.m1486_terminal.ChipTerminal`.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

import typer

from steptwin.cli.device import complain, number_of
from steptwin.cli.typedlines import typed_lines
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError

if TYPE_CHECKING:
    from steptwin.commands.m1486_terminal import ChipTerminal
    from steptwin.drivers.address import DeviceAddress
    from steptwin.drivers.place import Channel
    from steptwin.m1486.variants import Variant

HELP = """\
COMMAND             as the manual has it: x7, v2000, f12800, r, u1, t41, [ … ; k stops at once
raw TEXT            sent as it is; other commands are checked first, and wrong data are not sent
wait [SECONDS]      until the chips have done all commands: sends u20 and waits for the answer, 60 s
sleep SECONDS
help, quit"""
WAIT_S = 60.0


def chip_terminal(address: DeviceAddress, *, log_frames: bool) -> None:
    """Lines from the standard input to the chips. A script in a pipe ends at the first error."""
    from steptwin.m1486.variants import variant

    kind = None if address.variant is None else variant(address.variant)
    interactive = sys.stdin.isatty()

    def prompt() -> str:
        return f"{connection.selected or 'all'}> "

    def show(text: str) -> None:
        if not interactive:
            typer.echo(text)
            return
        import readline

        # It may arrive while a line is typed: it is printed above that line, which is redrawn.
        sys.stdout.write(f"\r\x1b[K{text}\n{prompt()}{readline.get_line_buffer()}")
        sys.stdout.flush()

    connection = _ChipConnection(address, kind, show, log_frames=log_frames)
    try:
        if interactive:
            with _errors_as_text():
                connection.verified()
            complain(f"M1486 on {address.place}; 'help' helps, k stops the motor, Ctrl-D ends")
        for line in typed_lines(prompt, lambda line: line.upper().startswith("K")):
            try:
                _answer(connection, line, kind, log_frames=log_frames, waits=not interactive)
            except KeyboardInterrupt:
                complain("interrupted")
            except SteptwinError as error:
                complain(str(error))
                if not interactive:
                    raise typer.Exit(2 if isinstance(error, Misuse) else 1) from None
    finally:
        connection.close()


@contextlib.contextmanager
def _errors_as_text() -> Generator[None]:
    try:
        yield
    except SteptwinError as error:
        complain(str(error))


class _ChipConnection:
    """The line to the chips. Before the first command the chip is selected and verified by its echo; only K does without."""

    def __init__(self, address: DeviceAddress, kind: Variant | None, show: Callable[[str], object], *, log_frames: bool) -> None:
        from steptwin.drivers.m1486.lines import line_endpoint

        self._address = address
        self._kind = kind
        self._show = show
        self._log_frames = log_frames
        self._endpoint = line_endpoint(address.place, address.baud)
        self._terminal: ChipTerminal | None = None
        self._is_verified = False

    @property
    def selected(self) -> str:
        """The chip selected last; empty if all chips are selected."""
        if self._terminal is not None:
            return self._terminal.selected
        return "" if self._address.chip is None else f"{self._address.chip:X}"

    def verified(self) -> ChipTerminal:
        """The line, with the chip selected. Raises `LineFailure` if it does not echo."""
        from steptwin.drivers.m1486.failures import NoEcho
        from steptwin.drivers.m1486.wake import wake

        if self._terminal is not None and self._is_verified:
            return self._terminal
        self.close()
        channel = self._endpoint.open()
        log = complain if self._log_frames else None
        try:
            wake(channel, str(self._endpoint), self._address.chip, self._address.baud, log)
        except BaseException as error:
            channel.close()
            if isinstance(error, NoEcho):
                raise LineFailure(f"{error}. Only k is typed as long as it does not echo") from error
            raise
        self._is_verified = True
        return self._opened(channel)

    def unverified(self) -> ChipTerminal:
        """The line for K, which is sent at once. It begins by selecting all chips, which ends an incomplete command."""
        if self._terminal is None:
            terminal = self._opened(self._endpoint.open())
            chip = self._address.chip
            # The first line may meet the rest of another one.
            for line in ("k",) if chip is None else ("xg", "xg", f"x{chip:x}"):
                _type(terminal, line, log_frames=self._log_frames)
        return self._terminal or self.unverified()

    def _opened(self, channel: Channel) -> ChipTerminal:
        from steptwin.commands.m1486_terminal import ChipTerminal

        self._terminal = ChipTerminal(channel, self._address.baud, self._kind, self._show)
        self._terminal.selected = "" if self._address.chip is None else f"{self._address.chip:X}"
        return self._terminal

    def close(self) -> None:
        if self._terminal is not None:
            self._terminal.close()
        self._terminal = None


def _answer(connection: _ChipConnection, line: str, kind: Variant | None, *, log_frames: bool, waits: bool) -> None:
    word, _, rest = line.partition(" ")
    if word == "help":
        typer.echo(HELP)
    elif word == "sleep":
        time.sleep(_seconds(rest, line))
    elif word == "wait":
        seconds = _seconds(rest, line) if rest.strip() else WAIT_S
        terminal = connection.verified()
        _type(terminal, "u20", log_frames=log_frames)
        terminal.settle(seconds)
    elif word == "raw":
        _typed(connection.verified(), rest, log_frames=log_frames, waits=waits)
    elif line:
        from steptwin.commands.m1486_terminal import command_of

        command = command_of(line, kind)
        if command is not None:
            terminal = connection.unverified() if command.key == "K" else connection.verified()
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
