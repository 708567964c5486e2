"""An M1486 in the live view."""

from __future__ import annotations

from collections.abc import Iterable

from rich.text import Text

from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.details import flags_on, functions_on, next_command, used_bits
from steptwin.m1486.lines import LINES
from steptwin.m1486.present import program_words, velocity
from steptwin.machine import SECOND, Nanos


def chip_lines(name: str, chip: M1486Chip, now: Nanos) -> list[Text]:
    """Position, speed, lines, memory and program."""
    title = Text(f"{name}  {now / SECOND:9.1f} s  ", style="bold")
    title.append(program_words(chip, now), style="bold red" if chip.program.is_held or chip.is_shut_down else "green")
    if not chip.receiver.is_listening:
        title.append("  (does not listen)", style="dim")
    return [title, _motion(chip, now), _memory(chip), _numbers(chip), _lines(chip), _others(chip)]


def _motion(chip: M1486Chip, now: Nanos) -> Text:
    drive = chip.drive
    text = Text(f"position {drive.counter_u(now):>9}")
    if not drive.is_valid:
        text.append(" not valid", style="yellow")
    text.append(f"   true {drive.true_u(now):>9}   {velocity(chip, now):9.1f} step/s   ")
    text.append(drive.motion.value, style="cyan" if drive.is_busy else "dim")
    return text.append(f"   M{drive.microstep} Q{drive.qualification}", style="dim")


def _memory(chip: M1486Chip) -> Text:
    following, receiver = next_command(chip), chip.receiver
    text = Text(f"memory {used_bits(chip)} of {chip.variant.memory_bits} bits")
    text.append(f"   input buffer {receiver.waiting} of {receiver.waiting + receiver.free}")
    return text.append("" if following is None else f"   next: {following}", style="cyan")


def _numbers(chip: M1486Chip) -> Text:
    text = Text(f"variable {chip.unit.variable}")
    for name, numbers in (("flags", flags_on(chip)), ("functions", functions_on(chip))):
        text.append(f"   {name} {' '.join(map(str, numbers)) or '-'}")
    return text


def _lines(chip: M1486Chip) -> Text:
    return _lamps("B", ((str(line), chip.level(line, chip.now)) for line in LINES))


def _others(chip: M1486Chip) -> Text:
    return _lamps(" ", chip.io.others.items())


def _lamps(name: str, levels: Iterable[tuple[str, int]]) -> Text:
    """High pins are lit."""
    text = Text(f"{name} ", style="bold")
    for label, level in levels:
        text.append(label, style="not bold black on green" if level else "not bold dim").append(" ", style="not bold")
    return text
