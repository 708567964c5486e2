"""``steptwin get``, ``set``: registers by name.

From Python: `steptwin.drivers.Mic488.get_shown` and `set`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli.addresses import SPACES, ValueAddress, places, read_places
from steptwin.cli.chip import get as chip_get
from steptwin.cli.chip import set_values
from steptwin.cli.device import Device, Json, LogFrames, find, opened, print_json, shown, table
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.drivers import Mic488
    from steptwin.mic488.registermap import Register, RegisterMap

_RUN = re.compile(r"(?P<head>\w+\[)(?P<first>\d+)-(?P<last>\d+)(?P<tail>\].*)")


def names_from(incomplete: str) -> list[str]:
    """Shell completion: names of registers with this beginning."""
    from steptwin.mic488.registers import register_map

    return [r.name for r in register_map() if r.name.startswith(incomplete.upper())]


def get(
    names: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME",
            help="M1_POS_ACT, OUT3, 'M*_ACC', USER_REGISTER[100-109], USER_REGISTER[4]:real; by address 10020, hr:10020:real, "
            "hr:10020-10023:hex, co:6000, di:5000",
            autocompletion=names_from,
        ),
    ],
    device: Device = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Read registers by name or address. 'steptwin registers mic488' lists them; an M1486 has POSITION, COUNTER, FLAGS…"""
    address = find(device)
    if address.kind == "m1486":
        chip_get(address, names, json=json, log_frames=log_frames)
        return
    with opened(address, log_frames=log_frames) as mic:
        registers = map_of(mic)
        values = look(mic, expanded(registers, names))
    if json:
        print_json(as_data(registers, values))
    else:
        typer.echo(table([_row(registers, name, value, unit) for name, (value, unit) in values.items()]))


def set_(
    changes: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME=VALUE", help="M1_ACC=50 OUT3=on DATA_TYPE=REAL USER_REGISTER[4]=7", autocompletion=names_from
        ),
    ],
    device: Device = None,
    json: Json = False,
    log_frames: LogFrames = False,
) -> None:
    """Write registers by name, one after the other. A motion register moves at once.

    A register that acts on every write is sent only once. If its response is lost, the message says that the write is
    unconfirmed.
    """
    address = find(device)
    if address.kind == "m1486":
        set_values(address, changes, log_frames=log_frames)
        return
    from steptwin.mic488.registermap import DataType
    from steptwin.mic488.values import encoded, named

    given = [_change(change) for change in changes]
    with opened(address, log_frames=log_frames) as mic:
        registers = map_of(mic)
        wanted = {name: value_of(registers.named(name.partition("[")[0]), text, change) for name, text, change in given}
        for name, value in wanted.items():  # all of them before the first is written
            encoded(named(registers, name), value, DataType.REAL)
        for name, value in wanted.items():
            mic.set(name, value)
        kept = [name for name in wanted if _holds(registers.named(name.partition("[")[0]))]
        values = mic.get_shown(*kept) if kept else {}
    if json:
        print_json(as_data(registers, values))
    elif values:
        typer.echo(table([_row(registers, name, value, unit) for name, (value, unit) in values.items()]))


def map_of(mic: Mic488) -> RegisterMap:
    from steptwin.mic488.registers import register_map

    return register_map(mic.firmware)


def look(mic: Mic488, wanted: Sequence[str | ValueAddress]) -> dict[str, tuple[Any, str]]:
    """Read values by name and by address, each with its unit."""
    names = [one for one in wanted if isinstance(one, str)]
    values = mic.get_shown(*names) if names else {}
    by_address = read_places(mic, [one for one in wanted if not isinstance(one, str)])
    return {str(one): values[one] if isinstance(one, str) else (by_address[one], "") for one in wanted}


def expanded(registers: RegisterMap, names: Sequence[str]) -> list[str | ValueAddress]:
    """Expand names with ``*`` and ``?``, ranges of user registers, and addresses.

    Raises `Misuse` for one that matches nothing.
    """
    found: dict[str | ValueAddress, None] = {}
    for name in names:
        run = _RUN.fullmatch(name)
        members: Sequence[str | ValueAddress] | None = places(name, registers)
        if members is not None:
            pass
        elif run is not None:
            first, last = int(run["first"]), int(run["last"])
            step = 2 if run["tail"].lower().endswith((":dint", ":real")) else 1
            members = [f"{run['head']}{number}{run['tail']}" for number in range(first, last + 1, step)]
        elif "*" in name or "?" in name:
            members = [r.name for r in registers if r.reads and r.cells == 1 and fnmatchcase(r.name, name.upper())]
        else:
            members = [name]
        if not members:
            raise Misuse(f"{name!r} matches no register that can be read; 'steptwin registers mic488' lists them")
        found |= dict.fromkeys(members)
    return list(found)


def _change(text: str) -> tuple[str, str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise Misuse(f"{text!r}: expected NAME=VALUE, such as M1_ACC=50")
    return name.strip(), value.strip(), text


def value_of(register: Register, value: str, whole: str) -> float:
    """A value as typed: a number, ON or OFF, or the text of an enumerated value. Raises `Misuse` naming ``whole``."""
    from steptwin.mic488 import values

    try:
        return values.value_of(register, value)
    except Misuse as error:
        raise Misuse(f"{whole!r}: {error}") from None


def _holds(register: Register) -> bool:
    from steptwin.mic488.registermap import WriteEffect

    return bool(register.reads) and register.effect is WriteEffect.STORE


def _meaning(registers: RegisterMap, name: str, value: Any) -> str:
    head = re.split(r"[\[:]", name)[0]
    if head in SPACES:
        return ""
    register = registers.named(head)
    return register.values.get(int(value), "") if register.values else ""


def _row(registers: RegisterMap, name: str, value: Any, unit: str) -> tuple[str, ...]:
    return name, shown(value), unit or _meaning(registers, name, value)


def as_data(registers: RegisterMap, values: dict[str, tuple[Any, str]]) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for name, (value, unit) in values.items():
        meaning = _meaning(registers, name, value)
        data[name] = {"value": value, **({"unit": unit} if unit else {}), **({"meaning": meaning} if meaning else {})}
    return data
