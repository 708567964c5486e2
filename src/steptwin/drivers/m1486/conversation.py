"""M1486 chips at a terminal: their one-letter commands, as the manual has them. See
`steptwin.drivers.kind.DeviceTerminal`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence

from steptwin.drivers.kind import DeviceAddress, Log
from steptwin.drivers.m1486.failures import NoEcho
from steptwin.drivers.m1486.lines import line_endpoint
from steptwin.drivers.m1486.terminal import ChipTerminal, command_of
from steptwin.drivers.m1486.unit import WAKE_COMMANDS
from steptwin.drivers.m1486.wake import wake
from steptwin.drivers.tcp import Channel
from steptwin.drivers.typed import number_of
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.m1486.variants import variant

HELP = """\
COMMAND             as the manual has it: x7, v2000, f12800, r, u1, t41, [ … ; k stops at once
raw TEXT            sent as it is; other commands are checked first, and wrong data are not sent
wait [SECONDS]      until the chips have done all commands: sends u20 and waits for the answer, 60 s
sleep SECONDS
help, quit"""
WAIT_S = 60.0


class ChipConversation:
    """The line to the chips. Before the first command the chip is selected and verified by its echo; only K does without."""

    help = HELP
    names: Sequence[str] = ()

    def __init__(self, address: DeviceAddress, show: Callable[[str], object], log: Log | None) -> None:
        self._address = address
        self._variant = None if address.variant is None else variant(address.variant)
        self._show = show
        self._log = log
        self._endpoint = line_endpoint(address.place, address.baud)
        self._terminal: ChipTerminal | None = None
        self._is_verified = False

    @property
    def greeting(self) -> str:
        return f"M1486 on {self._address.place}; 'help' helps, k stops the motor, Ctrl-D ends"

    @property
    def prompt(self) -> str:
        selected = self._first if self._terminal is None else self._terminal.selected
        return f"{selected or 'all'}> "

    @property
    def _first(self) -> str:
        """The chip that is selected at first; empty: all of them."""
        return "" if self._address.number is None else f"{self._address.number:X}"

    def greet(self) -> None:
        self._verified()

    def is_stop(self, line: str) -> bool:
        return line.upper().startswith("K")

    def answer(self, line: str, *, waits: bool) -> Iterator[str]:
        """Type a line; characters of chips are shown when they arrive."""
        word, _, rest = line.partition(" ")
        if word == "sleep":
            time.sleep(_seconds(rest, line))
        elif word == "wait":
            seconds = _seconds(rest, line) if rest.strip() else WAIT_S
            terminal = self._verified()
            self._type(terminal, "u20")
            if terminal.settle(seconds):
                raise Refusal(f"{line!r}: u20 found no room (5EH): the chip moves, waits or is held")
        elif word == "raw":
            self._typed(self._verified(), rest, waits=waits)
        elif line:
            command = command_of(line, self._variant)
            if command is not None:
                terminal = self._unverified() if command.key == "K" else self._verified()
                self._typed(terminal, line.partition(";")[0].strip(), waits=waits)
        return iter(())

    def _verified(self) -> ChipTerminal:
        """The line, with the chip selected. Raises `LineFailure` if it does not echo."""
        if self._terminal is not None and self._is_verified:
            return self._terminal
        self.close()
        channel = self._endpoint.open()
        try:
            wake(channel, str(self._endpoint), self._address.number, self._address.baud, self._log)
        except NoEcho as error:
            channel.close()
            raise LineFailure(f"{error}. Only k is typed as long as it does not echo") from error
        except BaseException:
            channel.close()
            raise
        self._is_verified = True
        return self._opened(channel, earlier=WAKE_COMMANDS)

    def _unverified(self) -> ChipTerminal:
        """The line for K, which is sent at once. It begins by selecting all chips, which ends an incomplete command."""
        if self._terminal is not None:
            return self._terminal
        terminal = self._opened(self._endpoint.open())
        # The first line may meet the rest of another one.
        for line in ("xg", "xg", f"x{self._first.lower()}") if self._first else ("k",):
            self._type(terminal, line)
        return terminal

    def _opened(self, channel: Channel, earlier: int = 0) -> ChipTerminal:
        self._terminal = ChipTerminal(channel, self._address.baud, self._variant, self._show, earlier=earlier)
        self._terminal.selected = self._first
        return self._terminal

    def close(self) -> None:
        if self._terminal is not None:
            self._terminal.close()
        self._terminal = None

    def _typed(self, terminal: ChipTerminal, text: str, *, waits: bool) -> None:
        self._type(terminal, text)
        if waits and terminal.settle(WAIT_S):
            raise Refusal(f"{text!r} found no room (5EH): the chip moves, waits or is held. 'wait' before it waits for that")

    def _type(self, terminal: ChipTerminal, text: str) -> None:
        if self._log is not None:
            self._log(f"→ {text} CR")
        terminal.type(text)


def _seconds(text: str, line: str) -> float:
    seconds = number_of(text, line)
    if not 0.0 <= seconds <= 3600.0:
        raise Misuse(f"{line!r}: permitted are 0 to 3600 s")
    return seconds
