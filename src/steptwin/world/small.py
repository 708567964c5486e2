"""Descriptions of small worlds: controllers on one line, as a text that a person can go on with."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, NamedTuple

from steptwin.durations import duration_text
from steptwin.machine import Nanos
from steptwin.world.faults.fault import Fault, value_text
from steptwin.world.tables import all_keys, written

LINE = "bus"
"""What the line is called."""
HOST = "host"
"""The script that sends lines to chips."""
AXES = "xyzu"
"""What the spindles of `demo` are called."""
GEAR = 100.0
"""Pulses per mm of `demo`."""
KL_MM, KR_MM = -10.0, 250.0
"""Where the switches of `demo` are, seen from the position at power-on."""
_COMMENT = 44
"""The column of comments."""
MOST_IN_A_ROW = 8
"""A longer list has a line for each element."""
_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")


@dataclass(frozen=True, slots=True)
class TomlTable:
    """A table of a description. Values that are None are left out; ``header`` where it is not that of its kind."""

    kind: str
    values: Mapping[str, object]
    _: KW_ONLY
    header: str = ""
    remark: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Whole:
    """What a small world has besides its controllers. ``line`` are values of ``[[line]]``."""

    name: str
    line: Mapping[str, object] = field(default_factory=dict)
    seed: int = 0
    state: str | None = None
    trace: str | None = None
    faults: Sequence[Fault] = ()


class InputChange(NamedTuple):
    """An input of a controller takes a level at a moment; ``note`` goes into the trace before it."""

    time: Nanos
    pin: str
    """``CONTROLLER.PIN``."""
    level: float
    note: str


class AxisSwitches(NamedTuple):
    """Where switches of an axis are (number from 1), seen from the place at power-on in configured units; None: there is none."""

    axis: int
    low: float | None
    high: float | None
    low_pin: str
    high_pin: str
    contacts: tuple[str, str] = ("NO", "NO")


def mic488_world(
    whole: Whole,
    units: Sequence[int | None],
    values: Mapping[str, object],
    *,
    demo: bool = False,
    switches: Iterable[AxisSwitches] = (),
    changes: Iterable[InputChange] = (),
) -> str:
    """MIC488 controllers by their units (None: that of the configuration), all with the same ``values`` of ``[[mic488]]``.

    ``demo``: each moves four spindles in mm with a switch at each end, so that homing and limits work from the first day.
    ``switches`` are those of axes of the first controller.
    """
    names = ["mic488" if len(units) == 1 else f"mic488-{unit}" for unit in units]
    tables = [_world(whole), _line(whole, "modbus")]
    for name, unit in zip(names, units, strict=True):
        tables.append(TomlTable("mic488", {"name": name, "line": LINE, "unit": unit, **values}))
        tables += _demo_axes() if demo else ()
    if demo:
        for name, unit in zip(names, units, strict=True):
            tables += _spindles(name, "" if len(names) == 1 else f"-{unit}")
    axes = [table for one in switches for table in _switches(names[0], one)]
    tables += [*axes, *_changes(changes), *_faults(whole.faults)]
    return _text(tables) + ("" if demo or axes else _EXAMPLE.format(controller=names[0]))


def m1486_world(
    whole: Whole,
    addresses: Sequence[int],
    values: Mapping[str, object],
    wires: Iterable[tuple[str, str]] = (),
    *,
    typed: Iterable[str] = (),
    changes: Iterable[InputChange] = (),
) -> str:
    """M1486 chips by their addresses, all with the same ``values`` of ``[[m1486]]``; wires between ``CHIP.PIN``.

    ``typed``: lines that a host sends as soon as all chips have room for them.
    """
    tables = [_world(whole), _line(whole, "m1486")]
    tables += [TomlTable("m1486", {"name": chip_name(one), "line": LINE, "address": one, **values}) for one in addresses]
    tables += [TomlTable("wire", {"from": source, "to": target}) for source, target in wires]
    tables += [*_host([chip_name(one) for one in addresses], typed), *_changes(changes)]
    return _text([*tables, *_faults(whole.faults)]) + _CHIP_EXAMPLE.format(controller=chip_name(addresses[0]))


def chip_name(address: int) -> str:
    """What a chip is called: ``chip7``, ``chipF``."""
    return f"chip{address:X}"


def _world(whole: Whole) -> TomlTable:
    values = {"name": whole.name, "seed": whole.seed or None, "state": whole.state, "trace": whole.trace}
    return TomlTable("world", values, remark="Run it with 'steptwin up FILE'; 'steptwin up --keys' shows what else it may have.")


def _line(whole: Whole, kind: str) -> TomlTable:
    return TomlTable("line", {"name": LINE, "kind": kind, **whole.line})


def _demo_axes() -> Iterator[TomlTable]:
    """Millimetres; KL on IN1–IN4, KR on IN5–IN8; homing backs off the switch (HOME1)."""
    for n in range(1, len(AXES) + 1):
        values = {"unit": "mm", "gear": GEAR, "acc": 50.0, "dec": 50.0, "vel": 25.0, "home_mode": "HOME1"}
        switches = {"limit_mode": "KL+KR", "in_kl": f"IN{n}", "in_kr": f"IN{n + 4}"}
        yield TomlTable("", {**values, **switches}, header=f"[mic488.M{n}]")


def _spindles(machine: str, suffix: str) -> Iterator[TomlTable]:
    for n, name in enumerate(AXES, start=1):
        remark = "Spindles with a switch at each end; travel, play, motors and encoders may follow." if n == 1 else ""
        yield TomlTable("axis", {"name": f"{name}{suffix}", "drive": f"{machine}.M{n}"}, remark=remark)
        yield TomlTable("switch", {"below": KL_MM, "to": f"{machine}.IN{n}"})
        yield TomlTable("switch", {"above": KR_MM, "to": f"{machine}.IN{n + 4}"})


def _switches(machine: str, axis: AxisSwitches) -> Iterator[TomlTable]:
    yield TomlTable("axis", {"name": f"m{axis.axis}", "drive": f"{machine}.M{axis.axis}"})
    for key, edge, pin, contact in (
        ("below", axis.low, axis.low_pin, axis.contacts[0]),
        ("above", axis.high, axis.high_pin, axis.contacts[1]),
    ):
        if edge is not None:
            yield TomlTable("switch", {key: edge, "to": f"{machine}.{pin}", "contact": None if contact == "NO" else contact})


def _changes(changes: Iterable[InputChange]) -> Iterator[TomlTable]:
    for change in changes:
        steps = [{"note": change.note}, {"set": {change.pin: change.level}}]
        yield TomlTable("event", {"at": duration_text(change.time), "steps": steps})


def _host(chips: Sequence[str], lines: Iterable[str]) -> Iterator[TomlTable]:
    room = " and ".join(f"{chip}.room" for chip in chips)
    steps = [step for line in lines for step in ({"until": room}, {"send": LINE, "text": f"{line}\r"})]
    if steps:
        yield TomlTable("script", {"name": HOST, "steps": steps}, remark="A host that sends lines as chips have room for them.")


def _faults(faults: Iterable[Fault]) -> Iterator[TomlTable]:
    for fault in faults:
        given = {key: value_text(value) if isinstance(value, tuple) else value for key, value in fault.given.items()}
        values = {"kind": fault.kind.name, "name": fault.name or None, **given}
        yield TomlTable("fault", values, header="[[fault]]")


_EXAMPLE = """
# An axis with a home switch:
#
# [[axis]]
# name = "x"
# drive = "{controller}.M1"
# unit = "mm"
# pitch = 5.0
#
# [[axis.switch]]
# below = 0.0
# to = "{controller}.IN1"
"""
_CHIP_EXAMPLE = """
# An axis with a switch that the program waits for:
#
# [[axis]]
# name = "x"
# drive = "{controller}.M1"
# unit = "mm"
# pitch = 5.0
#
# [[axis.switch]]
# below = 0.0
# to = "{controller}.LIMIT"
# contact = "NC"
"""


# ---------------------------------------------------------------------- text


def _text(tables: Iterable[TomlTable]) -> str:
    """TOML; keys are explained where they stand for the first time."""
    explained: set[str] = set()
    return "\n".join(_table_text(table, explained) for table in tables)


def _table_text(table: TomlTable, explained: set[str]) -> str:
    lines = [f"# {table.remark}"] if table.remark else []
    lines.append(table.header or written(table.kind))
    meanings = {key.name: key.meaning for key in all_keys().get(table.kind, ())}
    for name, value in table.values.items():
        if value is not None:
            line = f"{name} = {_value(value)}"
            meaning = meanings.get(name) if (place := f"{table.kind}.{name}") not in explained else None
            explained.add(place)
            lines.append(line if meaning is None or "\n" in line else f"{line:<{_COMMENT}}  # {meaning}")
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(str(key))} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, tuple | list) and len(value) > MOST_IN_A_ROW:
        return "[\n" + "".join(f"  {_value(item)},\n" for item in value) + "]"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)


def _key(name: str) -> str:
    return name if _BARE.match(name) else _value(name)
