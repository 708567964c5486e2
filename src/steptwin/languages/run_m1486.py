"""`steptwin run FILE.m1486`: run a program of an M1486 in virtual time.

A host sends the lines of the file as soon as the chips have room for them, on a line without delay. A program in ``[ ]`` for
a single E type is in its EEPROM at power-on instead, because writing it takes half a second per command.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.diagnostics import Severity, SourceText, render
from steptwin.errors import Misuse
from steptwin.files.coverage import CoverageReports
from steptwin.files.textfiles import read_text
from steptwin.files.timedinputs import TimedInput
from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.languages.chips import Chain, check_chain, parse_wire, placed_wires
from steptwin.languages.descriptions import print_world
from steptwin.languages.program_run import (
    NOTE,
    Ending,
    Outcome,
    Print,
    ProgramRun,
    report_causes,
    report_coverage,
    run_on,
    world_of,
    write,
)
from steptwin.m1486.check import CheckedChipProgram, check
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.events import M1486Event
from steptwin.m1486.lines import interface
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.pins import OPEN_ADDRESS, refuse_taken, settable_pin
from steptwin.m1486.present import describe_program, velocity
from steptwin.m1486.unit import counter_text
from steptwin.m1486.variants import DEFAULT, Store, Variant, variant
from steptwin.simulation.describe.generated import InputChange, Whole
from steptwin.simulation.describe.generated_m1486 import chip_name, m1486_world
from steptwin.simulation.kinds.lines import SCRIPTS
from steptwin.simulation.kinds.m1486.memory import PLACE
from steptwin.simulation.kinds.programs import StatementSubscription
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.wire.slave import FrameDirection

JSON_VERSION = 1

_HIDDEN = frozenset({"file", "power-on"})
"""Events that are not shown, because they follow from the file."""

_WRONG = frozenset({"wrong-data", "file-refused", "store-failed"})

_LINE_END = re.compile(r"\r\n|\r|\n")
FROM_HOST = f"{SCRIPTS}/{FrameDirection.IN.value}"
"""The subject of frames that the host sends."""


class ChipEvent(NamedTuple):
    """An event of a chip."""

    chip: str
    event: M1486Event


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Run(ProgramRun):
    """The options of a run."""

    variant: str = DEFAULT.name
    interface: str = "sd"
    wires: Sequence[str] = ()


def run(options: M1486Run, out: Print, warn: Print) -> bool:
    """Run a program in its own world and print what it did. Returns whether no error occurred. ``warn`` gets the findings of
    the checker.

    Raises `Misuse` for a program or option that cannot be run.
    """
    reports = CoverageReports(options.coverage)
    source = read_text(options.program).source
    kind, driver = variant(options.variant), interface(options.interface)
    checked = check(source.text, kind, driver)
    addresses = [chip.address for chip in checked.memory if chip.address is not None] or [OPEN_ADDRESS]
    chain = Chain(variant=kind, addresses=addresses, interface=driver, wires=[parse_wire(w) for w in options.wires])
    changes = [_change(change, chain) for change in options.inputs]
    is_stored = _is_stored(checked, chain)
    check_chain(chain, has_program=is_stored)
    typed = [] if is_stored else _LINE_END.split(source.text)
    text = describe_chips(chain, options.program.stem, options.program if is_stored else None, typed, changes)
    if options.print_world:
        print_world(text, f"run {options.program}")
        return True
    _warn_of_errors(checked, source, kind, warn)

    files = {str(options.program): read_bytes(options.program)} if is_stored else {}
    with world_of(text, files, options, keep_trace=options.trace is not None) as world:
        if not is_stored:
            for name in world.m1486:
                world.downloaded[name, PLACE] = source  # what the host is about to type
        reports.observe(world, Path())
        if options.trace is not None:
            StatementSubscription(world.programs, world.trace.add)
        chips = Chips(world, len(typed), changes)
        limit = options.longest
        begin = time.perf_counter()
        why = run_on(world, limit, lambda: chips.due(limit), chips.are_idle, until_idle=options.until_idle)
        outcome = Outcome(Ending(limit if why == "limit" else chips.end(), why), time.perf_counter() - begin)
        if options.as_json:
            out(json.dumps(_data(options, chips, outcome), ensure_ascii=False, indent=2))
        else:
            _print_lines(chips, outcome, out)
        write(world, options.trace, options.program.name, outcome.ending.at)
        report_coverage(reports, out)
        report_causes(world, options.questions, out)
    return not chips.went_wrong


def describe_chips(chain: Chain, name: str, program: Path | None, typed: Sequence[str], changes: Sequence[InputChange]) -> str:
    """The description of the world: chips to which a host sends lines, or that have a program at power-on."""
    values = {
        "variant": chain.variant.name,
        "interface": chain.interface.name,
        "program": None if program is None else str(program),
    }
    lines = [line.encode("latin-1", "replace").decode("latin-1") for line in typed]
    return m1486_world(Whole(name=name), chain.addresses, values, placed_wires(chain), typed=lines, changes=changes)


class Chips:
    """Observes the chips of a world in which a host sends lines."""

    def __init__(self, world: World, lines: int, changes: Sequence[InputChange]) -> None:
        self.world = world
        self._changes: dict[object, InputChange] = {change.note: change for change in changes}
        self.chips = {name: view.chip for name, view in world.m1486.items()}
        self.happened: list[ChipEvent] = []
        self.sent = bytearray()
        """The bytes that the host has received."""
        self.unsent = lines
        """Lines that are not sent yet, for lack of room."""
        self._last: Nanos = 0
        for name, chip in self.chips.items():
            for event in chip.events:
                self._happens(name, event)
        world.trace.subscribers.append(self._recorded)

    def _recorded(self, record: TraceRecord) -> None:
        if record.kind == "event" and record.controller in self.chips:
            self._happens(record.controller, M1486Event(record.time, record.subject, str(record.value)))
        elif record.kind == "event" and record.subject == NOTE and (change := self._changes.get(record.value)) is not None:
            chip, _, pin = change.pin.partition(".")
            self._happens(chip, M1486Event(record.time, "input", f"input {pin} {'high' if change.level else 'low'}"))
        elif record.kind == "frame" and record.subject == FROM_HOST:
            self.unsent -= 1
        elif record.kind == "frame" and isinstance(record.value, bytes):
            self.sent += record.value

    def _happens(self, chip: str, event: M1486Event) -> None:
        self.happened.append(ChipEvent(chip, event))
        self._last = event.time

    @property
    def went_wrong(self) -> bool:
        return any(happening.event.code in _WRONG for happening in self.happened)

    def due(self, limit: Nanos) -> Nanos | None:
        """The time of the next event without input, ns; None: there is none. The last W of a program ends without a deadline."""
        due, now = self.world.due(), self.world.now
        ready = max(chip.program.ready for chip in self.chips.values())
        return min(ready, limit) if due is None and ready > now else due

    def are_idle(self) -> bool:
        for chip in self.chips.values():
            chip.advance(self.world.now)
        return all(chip.is_idle() for chip in self.chips.values())

    def end(self) -> Nanos:
        """The time of the last event or the end of the last command, ns. It is found out only later."""
        done = (chip.program.ready for chip in self.chips.values())
        return max(self._last, *(moment for moment in done if moment <= self.world.now), 0)


def _is_stored(checked: CheckedChipProgram, chain: Chain) -> bool:
    """Whether the program is in the EEPROM of the chip at power-on; else a host sends it."""
    commands = checked.program.all_commands
    is_file = len(chain.addresses) == 1 and commands and (commands[0].key, commands[-1].key) == ("[", "]")
    if chain.variant.store is Store.EEPROM and is_file and checked.is_sound:
        with suppress(Misuse):  # several files
            return bool(image_of(checked.program, chain.variant))
    return False


def _warn_of_errors(checked: CheckedChipProgram, source: SourceText, kind: Variant, warn: Print) -> None:
    errors = [d for d in checked.diagnostics if d.severity is Severity.ERROR]
    if errors:
        typed = f", typed at {kind.write_ns / SECOND:g} s a command" if kind.store is Store.EEPROM else ""
        warn(render(source, errors))
        warn(f"{source.name}: executed as follows, with {len(errors)} error{'s' if len(errors) > 1 else ''}{typed}:")


def _change(change: TimedInput, chain: Chain) -> InputChange:
    """``B3`` of the only chip, or ``7.B3``."""
    names = {f"{address:X}": chip_name(address) for address in chain.addresses}
    chip, dot, pin = change.pin.rpartition(".")
    if not dot:
        if len(names) > 1:
            raise Misuse(f"--input {change.pin}: there are several chips; name one, such as {next(iter(names))}.{pin}")
        chip = next(iter(names))
    if chip not in names:
        raise Misuse(f"--input {change.pin}: no chip {chip}; there are {', '.join(names)}")
    name = settable_pin(pin, change.value)
    try:
        refuse_taken(name, chain.interface)
    except Misuse as error:
        raise Misuse(f"--input {change.pin}: {error}") from None
    placed = f"{names[chip]}.{name}"
    return InputChange(change.time, placed, change.value, f"{placed} {'high' if change.value else 'low'}")


# ---------------------------------------------------------------------- output


def _print_lines(chips: Chips, outcome: Outcome, out: Print) -> None:
    """Print a line for each event, and how the run ended."""
    several, now = len(chips.chips) > 1, chips.world.now
    for happening in sorted(chips.happened, key=lambda h: h.event.time):
        if happening.event.code not in _HIDDEN:
            chip = f"{_address(happening.chip)}  " if several else ""
            out(f"{happening.event.time / SECOND:14.6f} s  {chip}{happening.event.text}")
    for name, chip in chips.chips.items():
        out(f"{f'chip {_address(name)}: ' if several else ''}{_position(chip, now)}")
        if outcome.ending.why != "ended":
            out(f"  {describe_program(chip, now)}")
    if chips.sent:
        out(f"  sent {chips.sent.hex(' ').upper()}")
    if chips.unsent:
        out(f"{chips.unsent} lines of the file were not sent: the chips had no room for them")
    if outcome.ending.why == "limit":
        out("ended at the time limit; --for sets a longer one")
    out(str(outcome))


def _address(name: str) -> str:
    return name.removeprefix(chip_name(0)[:-1])


def _position(chip: M1486Chip, now: Nanos) -> str:
    drive = chip.drive
    counter = f"position {counter_text(drive.counter_u(now))}{'' if drive.is_valid else ' (not valid)'}"
    true = drive.true_u(now)
    moving = f", {drive.motion.value} at {velocity(chip, now):.1f} step/s" if drive.is_busy else ""
    return f"{counter}, true position {true} ({true / FULL_STEP:g} full steps){moving}"


def _data(options: M1486Run, chips: Chips, outcome: Outcome) -> dict[str, object]:
    happened = sorted(chips.happened, key=lambda h: h.event.time)
    return {
        "version": JSON_VERSION,
        "file": str(options.program),
        "language": "m1486",
        "variant": options.variant,
        "ended": "idle" if outcome.ending.why == "ended" else outcome.ending.why,
        "went_wrong": chips.went_wrong,
        "virtual_s": outcome.virtual_s,
        "wall_s": outcome.wall_s,
        "ratio": outcome.ratio,
        "lines_not_taken": chips.unsent,
        "sent": chips.sent.hex(),
        "chips": [_chip_data(name, chip, chips.world.now) for name, chip in chips.chips.items()],
        "events": [
            {"time_s": event.time / SECOND, "chip": _address(chip), "code": event.code, "text": event.text}
            for chip, event in happened
        ],
    }


def _chip_data(name: str, chip: M1486Chip, now: Nanos) -> dict[str, object]:
    drive = chip.drive
    return {
        "address": _address(name),
        "position": drive.counter_u(now),
        "position_valid": drive.is_valid,
        "true_position": drive.true_u(now),
        "program": describe_program(chip, now),
    }
