"""The device commands for an M1486: info, get, set, watch, send. Motions are in `steptwin.cli.chip_motion`.

From Python: `steptwin.drivers.m1486.M1486`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from steptwin.cli.device import SuspensionDetector, complain, number_of, print_json, shown, table
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.drivers.address import DeviceAddress
    from steptwin.drivers.m1486 import M1486

Shown = dict[str, tuple[Any, str]]
NAMES = ("POSITION", "COUNTER", "VARIABLE", "FLAGS", "FUNCTIONS", "TYPE", "INTERFACE", "SERIES")
_SETTINGS = {
    "S": "start_stop",
    "A": "acceleration",
    "V": "velocity",
    "P": "profile",
    "M": "microstep",
    "Q": "qualification",
    "N": "waveform",
}
_SWITCHES = {"ON": True, "TRUE": True, "1": True, "OFF": False, "FALSE": False, "0": False}
SETTABLE = "POSITION, VARIABLE, B1…B21, FLAG80…FLAG86, F40…F63, S, A, V, P, M, Q, N"


def chip_at(address: DeviceAddress, *, log_frames: bool = False) -> M1486:
    """The driver of a chip, which is not opened."""
    from steptwin.drivers.m1486 import M1486

    return M1486(
        address.place,
        address.chip,
        baud=address.baud,
        variant=address.variant,
        timeout_s=address.timeout,
        log=complain if log_frames else None,
    )


@contextlib.contextmanager
def opened_chip(address: DeviceAddress, *, log_frames: bool = False) -> Generator[M1486]:
    with chip_at(address, log_frames=log_frames) as chip:
        yield chip


# ---------------------------------------------------------------------- looking


def checked(names: Sequence[str]) -> list[str]:
    """Raises `Misuse` for an unknown name."""
    wanted = [name.upper() for name in names]
    for name in wanted:
        if name not in NAMES:
            raise Misuse(f"{name!r} is not a value of an M1486: permitted are {', '.join(NAMES)}")
    return wanted


def read(chip: M1486, names: Sequence[str]) -> Shown:
    """Read values by name, each with its unit. Raises `Misuse` for an unknown name."""
    wanted = checked(names)
    status = chip.status()
    known: Shown = {
        "POSITION": (status.position if status.is_position_valid else None, status.unit),
        "COUNTER": (status.counter_u, "min. microsteps"),
        "VARIABLE": (status.variable, ""),
        "FLAGS": (_on(status.flags), ""),
        "FUNCTIONS": (_on(status.functions), ""),
        "TYPE": (status.type, ""),
        "INTERFACE": (status.interface, ""),
        "SERIES": (status.series, ""),
    }
    return {name: known[name] for name in wanted}


def _on(states: Mapping[int, bool]) -> str:
    return " ".join(str(number) for number, on in states.items() if on) or "none"


def _print(values: Shown, *, as_json: bool) -> None:
    if as_json:
        print_json({name: {"value": value, "unit": unit} for name, (value, unit) in values.items()})
    else:
        typer.echo(table([(name, shown(value), unit) for name, (value, unit) in values.items()]))


def info(address: DeviceAddress, *, json: bool, log_frames: bool) -> None:
    with opened_chip(address, log_frames=log_frames) as chip:
        values = read(chip, NAMES)
        if json:
            print_json(
                {"device": chip.place, "chip": chip.address} | {name.lower(): value for name, (value, _) in values.items()}
            )
            return
        which = "" if chip.address is None else f", chip {chip.address:X}"
        typer.echo(f"{values['TYPE'][0]}{which} at {chip.place}, {values['INTERFACE'][0]}, series {values['SERIES'][0]}")
        typer.echo(f"position {shown(values['POSITION'][0])} {values['POSITION'][1]} ({values['COUNTER'][0]} min. microsteps)")
        typer.echo(f"internal variable {values['VARIABLE'][0]}; flags ON: {values['FLAGS'][0]}")
        typer.echo(f"functions ON: {values['FUNCTIONS'][0]}")


def get(address: DeviceAddress, names: Sequence[str], *, json: bool, log_frames: bool) -> None:
    wanted = checked(names)
    with opened_chip(address, log_frames=log_frames) as chip:
        _print(read(chip, wanted), as_json=json)


# ---------------------------------------------------------------------- changing


def set_values(address: DeviceAddress, changes: Sequence[str], *, log_frames: bool) -> None:
    """Set values. All changes are checked before anything is sent."""
    actions = [_action(change) for change in changes]
    with opened_chip(address, log_frames=log_frames) as chip:
        for action in actions:
            action(chip)


def _action(text: str) -> Callable[[M1486], object]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        raise Misuse(f"{text!r}: expected NAME=VALUE, such as VARIABLE=7 or B6=off")
    name = name.upper()
    if name == "POSITION":
        position = number_of(value, text)
        return lambda chip: chip.set_position(position)
    if name in _SETTINGS or name == "VARIABLE":
        number = number_of(value, text)
        if number != int(number):
            raise Misuse(f"{text!r}: {name} takes whole numbers")
        if name == "VARIABLE":
            return lambda chip: chip.set_variable(int(number))
        setting: dict[str, Any] = {_SETTINGS[name]: int(number)}
        return lambda chip: chip.configure(**setting)
    for prefix in ("FLAG", "B", "F"):
        if name.startswith(prefix) and name[len(prefix) :].isdecimal():
            return _switch(prefix, int(name[len(prefix) :]), value, text)
    raise Misuse(f"{text!r}: {name} cannot be set: permitted are {SETTABLE}")


def _switch(prefix: str, number: int, value: str, text: str) -> Callable[[M1486], object]:
    on = _SWITCHES.get(value.upper())
    if on is None:
        raise Misuse(f"{text!r}: expected on or off")
    match prefix:
        case "B":
            return lambda chip: chip.set_output(number, on)
        case "FLAG":
            return lambda chip: chip.set_flag(number, on)
        case _:
            return lambda chip: chip.set_function(number, on)


# ---------------------------------------------------------------------- programs


def send(address: DeviceAddress, file: Path, *, json: bool, log_frames: bool) -> None:
    """Download a program into the chips it selects with ``X``, or into the one addressed; it runs from its ``]`` on."""
    from steptwin.drivers.m1486 import M1486, M1486Line
    from steptwin.drivers.m1486.sync import download_to
    from steptwin.files.textfiles import read_text

    text = read_text(file).source.text
    addresses = _addressed(text, address.chip, file)
    with M1486Line(address.place, baud=address.baud, log=complain if log_frames else None) as line:
        chips = {a: M1486(line, a, variant=address.variant, timeout_s=address.timeout) for a in addresses}
        held_up = SuspensionDetector()
        for chip in chips.values():
            chip.open()
            held_up.check()
        with _progress(file.name) as progress:
            uploaded = download_to(chips.values(), text, first=chips.get(address.chip), progress=progress, name=str(file))
    title = next(iter(chips.values())).variant.title
    started = _started(text)
    if json:
        names = [None if a is None else f"{a:X}" for a in addresses]
        print_json(
            {"file": str(file), "type": title, "chips": names, "started": started is not None, "uploaded": uploaded.hex(" ")}
        )
        return
    where = f"the {title}" if len(addresses) == 1 else f"chips {', '.join(f'{a:X}' for a in addresses)} ({title})"
    typer.echo(f"{file} is in {where}{started or ''}" + (f"; it uploaded {uploaded.hex(' ')}" if uploaded else ""))


def _started(text: str) -> str | None:
    """What a downloaded program already does, as the end of a sentence; None if it cannot move the motor."""
    from steptwin.m1486.syntax import parse

    keys = {command.key for command in parse(text).program.commands}
    if "]" in keys:
        return " and was started by its ]: the motor may move; 'steptwin stop --program' ends it"
    return " and its commands were executed while it was sent: the motor may move" if keys & {"R", "(", ")", "J"} else None


def _addressed(text: str, chip: int | None, file: Path) -> list[int | None]:
    """The chips a program is for: those it selects with X, and ``chip`` for commands before the first X. Errors in it are
    reported later."""
    from steptwin.drivers.m1486.download import parts
    from steptwin.m1486.syntax import parse

    named = dict.fromkeys(chip if address is None else address for address, _ in parts(parse(text).program))
    if None in named and len(named) > 1:
        raise Misuse(f"{file} was not sent: the commands before its first X need a chip: --device ADDRESS,chip=N")
    return list(named) or [chip]


@contextlib.contextmanager
def _progress(title: str) -> Generator[Callable[[int, int], object]]:
    """A progress bar on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title)
        yield lambda done, total: bar.update(task, completed=done, total=total)
