"""`steptwin run FILE.m1486`: a program in virtual time, and what it does when.

A host types the file's lines as soon as the chips have room for them, on a line that takes no time. An E type that gets one
file in ``[ ]`` is switched on with it in its EEPROM instead: writing takes half a second a command.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

from steptwin.commands.m1486_bench import Bench, Ending, Happening, Input
from steptwin.diagnostics import Severity, Source, render
from steptwin.errors import Misuse
from steptwin.files.export.m1486_axes import chip_views
from steptwin.files.textfiles import read_text
from steptwin.files.timedinputs import TimedInput
from steptwin.m1486.check import Checked, check
from steptwin.m1486.chip import M1486, OPEN_ADDRESS
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.lines import Interface, interface
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.variants import DEFAULT, Store, Variant, variant
from steptwin.machine import SECOND, Nanos
from steptwin.served.m1486 import ChainOptions, chip_name, make_chips, parse_wire, pin_change, refuse_taken
from steptwin.words.m1486_state import program_words, velocity
from steptwin.world.trace import Trace

USUAL_LIMIT_NS: Nanos = 60 * SECOND
LIMIT_UNTIL_IDLE_NS: Nanos = 3600 * SECOND
JSON_VERSION = 1

_HIDDEN = frozenset({"file", "power-on"})
"""Events that say nothing new about a file that is run."""

_WRONG = frozenset({"wrong-data", "file-refused", "store-failed"})

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Run:
    """What is to be run. ``limit`` ends it where nothing else does; ``until_idle`` ends it also where it waits for ever."""

    program: Path
    variant: str = DEFAULT.name
    interface: str = "sd"
    wires: Sequence[str] = ()
    limit: Nanos | None = None
    until_idle: bool = False
    inputs: Sequence[TimedInput] = ()
    trace: Path | None = None
    as_json: bool = False


def run(options: M1486Run, say: Say, warn: Say) -> bool:
    """Run a program and say what it did; whether everything went right. ``warn`` is told what the checker found.

    Raises `Misuse` for what cannot be run.
    """
    source = read_text(options.program).source
    kind, driver = variant(options.variant), interface(options.interface)
    checked = check(source.text, kind, driver)
    addresses = [chip.address for chip in checked.memory if chip.address is not None] or [OPEN_ADDRESS]
    chain = ChainOptions(variant=kind, addresses=addresses, interface=driver, wires=[parse_wire(w) for w in options.wires])
    names = [chip_name(address) for address in addresses]
    inputs = [_input(change, names, driver) for change in options.inputs]
    text, image = _to_type(checked, chain, source.text)
    _warn_of_errors(checked, source, kind, warn)

    trace = Trace(names) if options.trace is not None else None
    chips = dict(zip(names, make_chips(chain, image=image).values(), strict=True))
    bench = Bench(chips, text, chain.wires, trace)
    report = _Json() if options.as_json else _Lines(say, several=len(names) > 1)
    limit = options.limit if options.limit is not None else LIMIT_UNTIL_IDLE_NS if options.until_idle else USUAL_LIMIT_NS
    begin = time.perf_counter()
    ending = bench.run(inputs, limit, lambda: report.take(bench), until_idle=options.until_idle)
    wall_s = time.perf_counter() - begin
    report.end(bench, Outcome(options, ending, wall_s), say)
    if trace is not None and options.trace is not None:
        _write(trace, options.trace, options.program.name, chips, ending.at)
    return not report.wrong


def _to_type(checked: Checked, chain: ChainOptions, text: str) -> tuple[str, bytes | None]:
    """What the host types, and what a chip has in its EEPROM before."""
    commands = checked.program.all_commands
    is_file = len(chain.addresses) == 1 and commands and (commands[0].key, commands[-1].key) == ("[", "]")
    if chain.variant.store is Store.EEPROM and is_file and checked.is_sound:
        try:
            return "", image_of(checked.program, chain.variant)
        except Misuse:
            pass  # several files: the host types them
    return text, None


def _warn_of_errors(checked: Checked, source: Source, kind: Variant, warn: Say) -> None:
    errors = [d for d in checked.diagnostics if d.severity is Severity.ERROR]
    if errors:
        typed = f", typed at {kind.write_ns / SECOND:g} s a command" if kind.store is Store.EEPROM else ""
        warn(render(source, errors))
        warn(f"{source.name}: the chip sees this, with {len(errors)} error{'s' if len(errors) > 1 else ''} in it{typed}:")


def _input(change: TimedInput, names: Sequence[str], driver: Interface) -> Input:
    """``B3`` of the only chip, or ``7.B3``."""
    chip, dot, pin = change.pin.rpartition(".")
    if not dot:
        if len(names) > 1:
            raise Misuse(f"--input {change.pin}: there are several chips; name one, such as {names[0]}.{pin}")
        chip = names[0]
    if chip not in names:
        raise Misuse(f"--input {change.pin}: no chip {chip}; there are {', '.join(names)}")
    name, level = pin_change(pin, change.value)
    refuse_taken(name, driver, f"--input {change.pin}: ")
    return Input(change.time, chip, name, level)


def _write(trace: Trace, where: Path, title: str, chips: Mapping[str, M1486], ended: Nanos) -> None:
    from steptwin.files.export import bar, write_trace

    write_trace(trace, where, views=chip_views(chips), title=title, ended=ended, watch=bar)


# ---------------------------------------------------------------------- what is said


class Outcome(NamedTuple):
    options: M1486Run
    ending: Ending
    wall_s: float

    @property
    def virtual_s(self) -> float:
        return self.ending.at / SECOND

    @property
    def ratio(self) -> float:
        return self.virtual_s / self.wall_s


class _Lines:
    """One line for each thing that happened, and the end."""

    def __init__(self, say: Say, *, several: bool) -> None:
        self._say = say
        self._several = several
        self.wrong = False

    def take(self, bench: Bench) -> None:
        # Chips that share no wire tell one after the other what happened meanwhile.
        told = sorted((h for h in bench.happened if h.event.code not in _HIDDEN), key=lambda h: h.event.time)
        bench.happened.clear()
        self.wrong = self.wrong or any(h.event.code in _WRONG for h in told)
        if told:
            self._say("\n".join(map(self._line, told)))

    def _line(self, happening: Happening) -> str:
        chip = f"{happening.chip}  " if self._several else ""
        return f"{happening.event.time / SECOND:14.6f} s  {chip}{happening.event.text}"

    def end(self, bench: Bench, outcome: Outcome, say: Say) -> None:
        for name, chip in bench.chips.items():
            say(f"{f'chip {name}: ' if self._several else ''}{_position(chip, bench.now)}")
            if bench.sent[name]:
                say(f"  sent {bench.sent[name].hex(' ').upper()}")
            if outcome.ending.why != "idle":
                say(f"  {program_words(chip, bench.now)}")
        if bench.untyped:
            say(f"{bench.untyped} lines of the file were not taken: there was no room for them")
        if outcome.ending.why == "limit":
            say("ended by the limit of time: --for takes a longer one")
        faster = f"{outcome.ratio:,.0f} times faster than real time"
        say(f"{outcome.virtual_s:.6f} s of virtual time in {outcome.wall_s:.3f} s: {faster}")


def _position(chip: M1486, now: Nanos) -> str:
    drive = chip.drive
    counter = f"position {drive.counter_u(now)}{'' if drive.is_valid else ' (not valid)'}"
    true = drive.true_u(now)
    moving = f", {drive.motion.value} at {velocity(chip, now):.1f} step/s" if drive.is_busy else ""
    return f"{counter}, true position {true} ({true / FULL_STEP:g} full steps){moving}"


class _Json:
    """The same as one object, printed at the end."""

    def __init__(self) -> None:
        self._events: list[dict[str, object]] = []
        self.wrong = False

    def take(self, bench: Bench) -> None:
        for name, event in bench.happened:
            self._events.append({"time_s": event.time / SECOND, "chip": name, "code": event.code, "text": event.text})
            self.wrong = self.wrong or event.code in _WRONG
        bench.happened.clear()

    def end(self, bench: Bench, outcome: Outcome, say: Say) -> None:
        self._events.sort(key=itemgetter("time_s"))
        data = {
            "version": JSON_VERSION,
            "file": str(outcome.options.program),
            "language": "m1486",
            "variant": outcome.options.variant,
            "ended": outcome.ending.why,
            "went_wrong": self.wrong,
            "virtual_s": outcome.virtual_s,
            "wall_s": outcome.wall_s,
            "ratio": outcome.ratio,
            "lines_not_taken": bench.untyped,
            "chips": [_chip_data(name, chip, bench) for name, chip in bench.chips.items()],
            "events": self._events,
        }
        say(json.dumps(data, ensure_ascii=False, indent=2))


def _chip_data(name: str, chip: M1486, bench: Bench) -> dict[str, object]:
    drive = chip.drive
    return {
        "address": name,
        "position": drive.counter_u(bench.now),
        "position_valid": drive.is_valid,
        "true_position": drive.true_u(bench.now),
        "program": program_words(chip, bench.now),
        "sent": bench.sent[name].hex(),
    }
