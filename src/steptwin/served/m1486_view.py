"""The live view of served M1486 chips in a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.text import Text

from steptwin.live.cell import Cell
from steptwin.live.output import Output
from steptwin.m1486.chip import M1486
from steptwin.m1486.lines import LINES
from steptwin.machine import SECOND, Nanos
from steptwin.served.m1486 import M1486Line
from steptwin.served.view import LiveView
from steptwin.words.m1486_state import flags_on, functions_on, next_command, program_words, used_bits, velocity


class M1486View(LiveView):
    """Position, speed, lines, memory and program of each chip."""

    traffic = "characters"

    def __init__(self, line: M1486Line, cell: Cell, output: Output) -> None:
        super().__init__(line, cell, output)
        self._chips = line.chips

    def blocks(self, now: Nanos, width: int) -> list[list[Text]]:
        return [_chip(address, chip, now) for address, chip in self._chips.items()]


def _chip(address: int, chip: M1486, now: Nanos) -> list[Text]:
    title = Text(f"chip {address:X}  {now / SECOND:9.1f} s  ", style="bold")
    title.append(program_words(chip, now), style="bold red" if chip.program.is_held or chip.is_shut_down else "green")
    if not chip.receiver.is_listening:
        title.append("  (does not listen)", style="dim")
    return [title, _motion(chip, now), _memory(chip), _numbers(chip), _lines(chip), _others(chip)]


def _motion(chip: M1486, now: Nanos) -> Text:
    drive = chip.drive
    text = Text(f"position {drive.counter_u(now):>9}")
    if not drive.is_valid:
        text.append(" not valid", style="yellow")
    text.append(f"   true {drive.true_u(now):>9}   {velocity(chip, now):9.1f} step/s   ")
    text.append(drive.motion.value, style="cyan" if drive.is_busy else "dim")
    return text.append(f"   M{drive.microstep} Q{drive.qualification}", style="dim")


def _memory(chip: M1486) -> Text:
    following, receiver = next_command(chip), chip.receiver
    text = Text(f"memory {used_bits(chip)} of {chip.variant.memory_bits} bits")
    text.append(f"   input buffer {receiver.waiting} of {receiver.waiting + receiver.free}")
    return text.append("" if following is None else f"   next: {following}", style="cyan")


def _numbers(chip: M1486) -> Text:
    text = Text(f"variable {chip.unit.variable}")
    for name, numbers in (("flags", flags_on(chip)), ("functions", functions_on(chip))):
        text.append(f"   {name} {' '.join(map(str, numbers)) or '-'}")
    return text


def _lines(chip: M1486) -> Text:
    return _lamps("B", ((str(line), chip.level(line)) for line in LINES))


def _others(chip: M1486) -> Text:
    return _lamps(" ", chip.io.others.items())


def _lamps(name: str, levels: Iterable[tuple[str, int]]) -> Text:
    """High pins are lit."""
    text = Text(f"{name} ", style="bold")
    for label, level in levels:
        text.append(label, style="not bold black on green" if level else "not bold dim").append(" ", style="not bold")
    return text
