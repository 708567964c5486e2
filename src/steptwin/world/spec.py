"""The description of a world: what its TOML file may say, and what it says.

Every table has rows (`KEYS`): the reader, the messages and the reference page take them from here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from steptwin.errors import Misuse
from steptwin.m1486.lines import INTERFACES
from steptwin.m1486.variants import VARIANTS
from steptwin.machine import MILLISECOND, Nanos
from steptwin.mic488.config import AXIS_KEYS, INPUT_KEYS, INPUTS, ControllerConfig
from steptwin.mic488.config import Key as ConfigKey
from steptwin.mic488.registers import AXES, FIRMWARES
from steptwin.wire.rtu import MAX_UNIT
from steptwin.world.faults import Fault, parse
from steptwin.world.reader import (
    Key,
    Path,
    Text,
    flag,
    name_value,
    number,
    pair,
    pin_name,
    points,
    read_table,
    text_value,
    time_value,
    whole,
    word,
)
from steptwin.world.script import Step, read_steps

_positive = number(0.0, above=True)
_not_negative = number(0.0)


def _optional(read: Callable[[Any], Any], name: str, meaning: str, default: Any = None, attribute: str = "") -> Key:
    return Key(name, read, meaning, default, attribute)


# ---------------------------------------------------------------------- what there is


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSpec:
    name: str
    kind: str
    baud: int | None
    timing: str
    tcp: str | None
    rtu_tcp: str | None
    pty: str | None
    serial: str | None
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Mic488Spec:
    name: str
    line: str | None
    unit: int | None
    firmware: str
    config: str | None
    program: str | None
    positions: str | None
    start: bool
    statement_time: Nanos | None
    lenient: bool
    axes: Mapping[int, Mapping[str, Any]]
    """Changed attributes of `AxisConfig`, by axis from 1."""
    inputs: Mapping[int, Mapping[str, Any]]
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Spec:
    name: str
    line: str | None
    variant: str
    address: int
    interface: str
    baud: int | None
    statement_time: Nanos | None
    program: str | None
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchSpec:
    """On at and below ``below``, at and above ``above``, or around ``position`` over ``width``; units of the axis."""

    target: tuple[str, str]
    below: float | None
    above: float | None
    position: float | None
    width: float
    hysteresis: float
    contact: str
    bounce: Nanos
    bounces: int
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderSpec:
    counts_per_rev: int | None
    counts_per_unit: float | None
    index: bool
    offset: float
    index_width: int
    mount: str
    follows: str | None
    slip: float
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorSpec:
    """Torques in N·m at the motor, speeds in rev/min; for linear axes mass in kg and forces in N as well."""

    torque: tuple[tuple[float, float], ...]
    inertia: float
    mass: float
    friction: float
    friction_force: float
    load: float
    force: float
    start_speed: float | None
    full_steps: int
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisSpec:
    name: str
    drive: tuple[str, str]
    kind: str
    unit: str
    pulses_per_unit: float | None
    pitch: float | None
    pulses_per_rev: int
    inverted: bool
    travel: tuple[float, float] | None
    start: float
    backlash: float
    switches: tuple[SwitchSpec, ...]
    encoder: EncoderSpec | None
    motor: MotorSpec | None
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WireSpec:
    source: tuple[str, str]
    target: tuple[str, str]
    inverted: bool
    delay: Nanos
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ButtonSpec:
    name: str
    target: tuple[str, str]
    contact: str
    bounce: Nanos
    bounces: int
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceSpec:
    target: tuple[str, str]
    kind: str
    value: float
    amplitude: float
    frequency: float
    phase: float
    points: tuple[tuple[float, float], ...]
    begin: float
    end: float
    ramp_time: Nanos
    repeat: Nanos | None
    period: Nanos
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ScriptSpec:
    """An event or a script: when it begins, what it does."""

    name: str
    at: Nanos | None
    every: Nanos | None
    when: str | None
    once: bool
    repeat: int
    steps: tuple[Step, ...]
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldSpec:
    """A world as its file describes it. ``text`` is the file."""

    name: str
    seed: int
    lines: tuple[LineSpec, ...]
    mic488: tuple[Mic488Spec, ...]
    m1486: tuple[M1486Spec, ...]
    axes: tuple[AxisSpec, ...]
    wires: tuple[WireSpec, ...]
    buttons: tuple[ButtonSpec, ...]
    sources: tuple[SourceSpec, ...]
    scripts: tuple[ScriptSpec, ...]
    faults: tuple[Fault, ...]
    text: Text

    def files(self) -> list[str]:
        """Names of the files the description refers to."""
        named = [name for spec in self.mic488 for name in (spec.config, spec.program, spec.positions)]
        named += [spec.program for spec in self.m1486]
        return sorted({name for name in named if name is not None})


# ---------------------------------------------------------------------- rows


def _texts(value: Any) -> str:
    return text_value(value)


def _firmware(value: Any) -> str:
    return word(*FIRMWARES)(f"{value:.2f}" if isinstance(value, float) else value)


def _variant(value: Any) -> str:
    return word(*(v.name for v in VARIANTS))(value.upper().removeprefix("M1486") if isinstance(value, str) else value)


def _address(value: Any) -> int:
    if isinstance(value, str) and len(value) == 1 and value in "0123456789ABCDEFabcdef":
        return int(value, 16)
    return whole(0, 15)(value)


_CONTACT = _optional(word("NO", "NC"), "contact", "NO (closed while on) or NC (open while on)", "NO")
_BOUNCE = (
    _optional(time_value, "bounce", "how long the contact bounces, such as '3 ms'", 0),
    _optional(whole(1, 100), "bounces", "how often it opens again meanwhile", 3),
)

KEYS: Mapping[str, tuple[Key, ...]] = {
    "world": (
        _optional(text_value, "name", "a name for people", "world"),
        _optional(whole(0, 2**63 - 1), "seed", "where all chance comes from", 0),
    ),
    "line": (
        Key("name", name_value, "how controllers and scripts name it"),
        _optional(word("modbus", "m1486"), "kind", "modbus (MIC488) or m1486", "modbus"),
        _optional(whole(300, 1_000_000), "baud", "bit/s; default 38400, the highest of the chips"),
        _optional(word("real", "off"), "timing", "real: characters take their time; off", "off"),
        _optional(_texts, "tcp", "HOST:PORT for live clients (Modbus TCP, or raw characters)"),
        _optional(_texts, "rtu_tcp", "HOST:PORT for live clients of RTU over TCP"),
        _optional(_texts, "pty", "path of a pseudo terminal for a live client"),
        _optional(_texts, "serial", "a real serial port"),
    ),
    "mic488": (
        Key("name", name_value, "how the rest of the file names it"),
        _optional(name_value, "line", "the line it is on"),
        _optional(whole(1, MAX_UNIT), "unit", "slave address; default that of its configuration"),
        _optional(_firmware, "firmware", f"one of {', '.join(FIRMWARES)}", "1.70"),
        _optional(text_value, "config", "the vendor tool's .cfg file"),
        _optional(text_value, "program", "a WBC program for bank 0"),
        _optional(text_value, "positions", "a position table for bank 0"),
        _optional(flag, "start", "whether the program starts at power-on", False),
        _optional(time_value, "statement_time", "what a statement of the program takes"),
        _optional(flag, "lenient", "holes of the register map read 0", False),
    ),
    "m1486": (
        Key("name", name_value, "how the rest of the file names it"),
        _optional(name_value, "line", "the line it is on"),
        _optional(_variant, "variant", f"one of {', '.join(v.name for v in VARIANTS)}", "B"),
        _optional(_address, "address", "0 to 15, or a hexadecimal digit as text", 15),
        _optional(word(*(i.name for i in INTERFACES)), "interface", "driver interface: sd, dual or two", "sd"),
        _optional(whole(300, 1_000_000), "baud", "bit/s; default the highest"),
        _optional(time_value, "statement_time", "what a command takes; default 1 ms"),
        _optional(text_value, "program", "a program it is switched on with"),
    ),
    "axis": (
        Key("name", name_value, "how scripts and conditions name it"),
        Key("drive", pin_name, "what drives it: MACHINE.M1 to M4 of a MIC488, MACHINE.M1 of an M1486"),
        _optional(word("linear", "rotary"), "kind", "linear or rotary", "linear"),
        _optional(text_value, "unit", "unit of its positions: mm, cm, m, degree, rev, or anything"),
        _optional(_positive, "pulses_per_unit", "pulses (M1486: minimum microsteps) per unit"),
        _optional(_positive, "pitch", "units per motor revolution, instead of pulses_per_unit"),
        _optional(whole(1, 10_000_000), "pulses_per_rev", "pulses per motor revolution", 3200),
        _optional(flag, "inverted", "whether positive pulses go down", False),
        _optional(pair, "travel", "[low, high]: hard stops"),
        _optional(number(), "start", "where it stands when the world begins", 0.0),
        _optional(_not_negative, "backlash", "play between motor and load", 0.0),
    ),
    "switch": (
        Key("to", pin_name, "the input: MACHINE.PIN", attribute="target"),
        _optional(number(), "below", "on at and below this position"),
        _optional(number(), "above", "on at and above this position"),
        _optional(number(), "position", "on around this position, with width"),
        _optional(_not_negative, "width", "how wide the zone around position is", 0.0),
        _optional(_not_negative, "hysteresis", "how much further it stays on", 0.0),
        _CONTACT,
        *_BOUNCE,
    ),
    "encoder": (
        _optional(whole(-(10**9), 10**9), "counts_per_rev", "counts per motor revolution; negative: backwards"),
        _optional(number(), "counts_per_unit", "counts per unit of the axis, for an encoder on the load"),
        _optional(flag, "index", "whether channel C gives an index once per revolution", False),
        _optional(number(), "offset", "position of an index", 0.0),
        _optional(whole(1, 10**6), "index_width", "width of the index in pulses", 4),
        _optional(word("motor", "load"), "mount", "on the motor, or on the load behind the play", "motor"),
        _optional(name_value, "follows", "another axis whose load turns it (electronic gear)"),
        _optional(number(0.0, 1.0), "slip", "the part of the motion that its coupling loses", 0.0),
    ),
    "motor": (
        Key("torque", points, "pull-out torque: [[rev/min, N·m], ...] from 0 on; none above the last speed"),
        _optional(_not_negative, "inertia", "kg·m² of rotor and load, at the motor", 0.0),
        _optional(_not_negative, "mass", "kg moved by a linear axis", 0.0),
        _optional(_not_negative, "friction", "N·m against motion", 0.0),
        _optional(_not_negative, "friction_force", "N against motion of a linear axis", 0.0),
        _optional(number(), "load", "constant N·m; positive pulls towards lower positions", 0.0),
        _optional(number(), "force", "constant N on a linear axis; positive pulls towards lower positions", 0.0),
        _optional(_not_negative, "start_speed", "rev/min it starts with at once and is caught at; default any, caught at rest"),
        _optional(whole(4, 10_000), "full_steps", "full steps per revolution", 200),
    ),
    "wire": (
        Key("from", pin_name, "the output: MACHINE.PIN", attribute="source"),
        Key("to", pin_name, "the input: MACHINE.PIN", attribute="target"),
        _optional(flag, "inverted", "whether the level is turned round", False),
        _optional(time_value, "delay", "how much later it arrives", 0),
    ),
    "button": (
        Key("name", name_value, "how scripts name it"),
        Key("to", pin_name, "the input: MACHINE.PIN", attribute="target"),
        _CONTACT,
        *_BOUNCE,
    ),
    "source": (
        Key("to", pin_name, "the analog input: MACHINE.AIN1 or AIN2", attribute="target"),
        _optional(word("constant", "ramp", "sine", "table"), "kind", "constant, ramp, sine or table", "constant"),
        _optional(number(), "value", "volts; of a sine its mean", 0.0),
        _optional(number(), "amplitude", "volts", 0.0),
        _optional(_not_negative, "frequency", "Hz", 1.0),
        _optional(number(), "phase", "degrees", 0.0),
        _optional(points, "points", "table: [[seconds, volts], ...]", ()),
        _optional(number(), "begin", "ramp: volts at first", 0.0),
        _optional(number(), "end", "ramp: volts in the end", 0.0),
        _optional(time_value, "over", "ramp: how long it takes", 0, "ramp_time"),
        _optional(time_value, "repeat", "begins anew after this time"),
        _optional(time_value, "period", "how often the voltage is renewed", 10 * MILLISECOND),
    ),
    "event": (
        _optional(name_value, "name", "for the trace"),
        _optional(time_value, "at", "when"),
        _optional(time_value, "every", "again and again"),
        _optional(text_value, "when", "a condition, such as 'x.position > 100'"),
        _optional(flag, "once", "only the first time the condition comes true", False),
    ),
    "script": (
        Key("name", name_value, "for the trace"),
        _optional(time_value, "at", "when it begins", 0),
        _optional(whole(1, 10**9), "repeat", "how often all of it is done", 1),
    ),
}


TABLES: Mapping[str, str] = {
    "world": "[world]",
    "line": "[[line]]",
    "mic488": "[[mic488]]",
    "m1486": "[[m1486]]",
    "axis": "[[axis]]",
    "switch": "[[axis.switch]]",
    "encoder": "[axis.encoder]",
    "motor": "[axis.motor]",
    "wire": "[[wire]]",
    "button": "[[button]]",
    "source": "[[source]]",
    "event": "[[event]]",
    "script": "[[script]]",
}
"""How each table is written."""

# ---------------------------------------------------------------------- reading


def read_world(name: str, text: str) -> WorldSpec:
    """The world that a TOML text called ``name`` describes. Raises `WorldError` with everything that is wrong with it."""
    toml = Text(name, text)
    data = toml.data
    known = [key for key in KEYS if key not in ("switch", "encoder", "motor")]
    for key in data:
        if key not in known and key != "fault":
            near = toml.near(key, [*known, "fault"])
            toml.wrong((key,), "D004", f"the file has no [{key}]{near}", f"permitted: {', '.join([*known, 'fault'])}")
    world = read_table(toml, ("world",), data.get("world", {}), KEYS["world"])
    spec = WorldSpec(
        **world,
        lines=tuple(LineSpec(**row) for row in _rows(toml, "line")),
        mic488=tuple(_mic488(toml, row, table) for row, table in _tables(toml, "mic488", _CONTROLLER_TABLES)),
        m1486=tuple(M1486Spec(**row) for row in _rows(toml, "m1486")),
        axes=tuple(_axis(toml, row, table) for row, table in _tables(toml, "axis", ("switch", "encoder", "motor"))),
        wires=tuple(WireSpec(**row) for row in _rows(toml, "wire")),
        buttons=tuple(ButtonSpec(**row) for row in _rows(toml, "button")),
        sources=tuple(SourceSpec(**row) for row in _rows(toml, "source")),
        scripts=(*_events(toml), *_scripts(toml)),
        faults=tuple(_faults(toml)),
        text=toml,
    )
    toml.check()
    return spec


_CONTROLLER_TABLES = (*(f"M{n}" for n in range(1, AXES + 1)), *(f"IN{n}" for n in range(1, INPUTS + 1)))


def _tables(toml: Text, kind: str, also: tuple[str, ...] = ()) -> list[tuple[dict[str, Any], Mapping[str, Any]]]:
    """Values of every ``[[kind]]`` that has all it needs, and the table itself."""
    found: list[tuple[dict[str, Any], Mapping[str, Any]]] = []
    tables = toml.data.get(kind, [])
    if not isinstance(tables, list):
        toml.wrong((kind,), "D002", f"[{kind}] stands once", f"expected [[{kind}]], for there may be several")
        tables = []
    names: set[str] = set()
    for number_, table in enumerate(tables):
        path = (kind, number_)
        values = read_table(toml, path, table, KEYS[kind], also)
        if any(key.is_required and (key.attribute or key.name) not in values for key in KEYS[kind]):
            continue
        if values.get("name") is not None and values["name"] in names:
            toml.wrong((*path, "name"), "D006", f"there is a [[{kind}]] named {values['name']!r} already")
        names.add(values.get("name", ""))
        found.append((values | {"path": path}, table))
    return found


def _rows(toml: Text, kind: str) -> list[dict[str, Any]]:
    return [row for row, _ in _tables(toml, kind)]


def _mic488(toml: Text, row: dict[str, Any], table: Mapping[str, Any]) -> Mic488Spec:
    path = row["path"]
    axes = {n: _config(toml, (*path, f"M{n}"), table, AXIS_KEYS) for n in range(1, AXES + 1) if f"M{n}" in table}
    inputs = {n: _config(toml, (*path, f"IN{n}"), table, INPUT_KEYS) for n in range(1, INPUTS + 1) if f"IN{n}" in table}
    return Mic488Spec(**row, axes=axes, inputs=inputs)


def _config(toml: Text, path: Path, table: Mapping[str, Any], rows: tuple[ConfigKey, ...]) -> dict[str, Any]:
    """A table such as ``[mic488.M1]``: keys are attributes of the configuration, choices are numbers or their words."""
    keys = tuple(Key(row.attribute, _configured(row), row.hint, None) for row in rows)
    values = read_table(toml, path, table[str(path[-1])], keys)
    return {name: value for name, value in values.items() if value is not None}


def _configured(row: ConfigKey) -> Callable[[Any], Any]:
    words = {text.upper(): number for number, text in row.choices.items() if text}

    def read(value: Any) -> Any:
        if isinstance(value, str):
            if row.attribute in ("in_kl", "in_kr") and value.upper().startswith("IN") and value[2:].isdecimal():
                value = int(value[2:]) - 1
            elif value.upper() in words:
                value = words[value.upper()]
            else:
                raise Misuse(f"{value!r}: permitted are {', '.join(words)}" if words else f"{value!r} is no number")
        if isinstance(value, bool) or not isinstance(value, int | float) or not row.permits(value):
            raise Misuse(f"{value!r} is not permitted")
        return int(value) if row.whole and value == int(value) else value

    return read


def _axis(toml: Text, row: dict[str, Any], table: Mapping[str, Any]) -> AxisSpec:
    path = row["path"]
    switches: list[SwitchSpec] = []
    given = table.get("switch", [])
    for n, switch in enumerate(given if isinstance(given, list) else [given]):
        place = (*path, "switch", n)
        values = read_table(toml, place, switch, KEYS["switch"])
        if "target" in values:
            spec = SwitchSpec(**values, path=place)
            if sum(x is not None for x in (spec.below, spec.above, spec.position)) != 1:
                toml.wrong(place, "D007", "a switch needs one of below, above and position")
            switches.append(spec)
    encoder = motor = None
    if "encoder" in table:
        encoder = EncoderSpec(**read_table(toml, (*path, "encoder"), table["encoder"], KEYS["encoder"]), path=(*path, "encoder"))
    if "motor" in table:
        values = read_table(toml, (*path, "motor"), table["motor"], KEYS["motor"])
        if "torque" in values:
            motor = MotorSpec(**values, path=(*path, "motor"))
            if motor.torque[0][0] != 0.0 or any(torque < 0.0 for _, torque in motor.torque):
                toml.wrong((*path, "motor", "torque"), "D003", "a torque curve begins at 0 rev/min and is never negative")
    if row["pulses_per_unit"] is not None and row["pitch"] is not None:
        toml.wrong((*path, "pitch"), "D007", "pulses_per_unit and pitch exclude each other")
    if row["unit"] is None:
        row["unit"] = "mm" if row["kind"] == "linear" else "degree"
    if row["travel"] is not None and not row["travel"][0] <= row["start"] <= row["travel"][1]:
        toml.wrong((*path, "start"), "D007", f"start = {row['start']:g} is outside travel = {list(row['travel'])}")
    return AxisSpec(**row, switches=tuple(switches), encoder=encoder, motor=motor)


def _events(toml: Text) -> list[ScriptSpec]:
    found: list[ScriptSpec] = []
    for row, table in _tables(toml, "event", ("do",)):
        path = row["path"]
        if sum(row[key] is not None for key in ("at", "every", "when")) != 1:
            toml.wrong(path, "D007", "an event needs one of at, every and when")
            continue
        name = row.pop("name") or f"event-{path[1] + 1}"
        steps = _steps(toml, (*path, "do"), table)
        found.append(ScriptSpec(name=name, repeat=1, steps=steps, **row))
    return found


def _scripts(toml: Text) -> list[ScriptSpec]:
    found: list[ScriptSpec] = []
    for row, table in _tables(toml, "script", ("steps",)):
        steps = _steps(toml, (*row["path"], "steps"), table)
        found.append(ScriptSpec(**row, every=None, when=None, once=True, steps=steps))
    return found


def _steps(toml: Text, path: Path, table: Mapping[str, Any]) -> tuple[Step, ...]:
    key = str(path[-1])
    if key not in table:
        toml.wrong(path, "D005", f"{key} is missing", "a list of steps, such as [{ press = 'start' }, { wait = '1 s' }]")
        return ()
    return read_steps(toml, path, table[key])


def _faults(toml: Text) -> list[Fault]:
    found: list[Fault] = []
    for n, table in enumerate(toml.data.get("fault", [])):
        try:
            found.append(parse(table, "[[fault]]"))
        except Misuse as error:
            key = re.search(r"(\w+) = ", str(error))
            toml.wrong(("fault", n, key[1] if key else ""), "D003", str(error))
    return found


def config_of(spec: Mic488Spec, base: ControllerConfig) -> ControllerConfig:
    """The configuration of a controller: its file's, and what the description changes."""
    from dataclasses import replace

    axes = tuple(replace(axis, **spec.axes.get(n, {})) for n, axis in enumerate(base.axes, start=1))
    inputs = tuple(replace(one, **spec.inputs.get(n, {})) for n, one in enumerate(base.inputs, start=1))
    config = replace(base, axes=axes, inputs=inputs)
    return replace(config, program=replace(config.program, activate=1)) if spec.start else config
