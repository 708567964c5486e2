"""What the TOML file of a world may say: every table has rows (`KEYS`).

The reader, the messages and the reference page take them from here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from steptwin.errors import Misuse
from steptwin.m1486.lines import INTERFACES
from steptwin.m1486.variants import VARIANTS
from steptwin.machine import MILLISECOND, Nanos
from steptwin.mic488.registers import FIRMWARES
from steptwin.wire.rtu import MAX_UNIT
from steptwin.world.addresses import parse_address
from steptwin.world.durations import duration
from steptwin.world.reader import (
    Key,
    banks_value,
    flag,
    name_value,
    number,
    pair,
    pin_name,
    points,
    positive_time,
    text_value,
    time_value,
    whole,
    word,
)
from steptwin.world.script import STEPS

MOST_GAP_MS = 10_000

_positive = number(0.0, above=True)
_not_negative = number(0.0)


def _optional(read: Callable[[Any], Any], name: str, meaning: str, default: Any = None, attribute: str = "") -> Key:
    return Key(name, read, meaning, default, attribute)


def _address_text(value: Any) -> str:
    """HOST:PORT as it is written; whether it may be reached by others is decided where the line is opened."""
    parse_address(text_value(value), listen_any=True)
    return value


def _gap(value: Any) -> Nanos:
    """Milliseconds, as the command line takes them, or a text such as ``"5 ms"``."""
    found = duration(value) if isinstance(value, str) else round(number(0.0, MOST_GAP_MS, above=True)(value) * MILLISECOND)
    if not 0 < found <= MOST_GAP_MS * MILLISECOND:
        raise Misuse(f"{value!r}: permitted are more than 0 and at most {MOST_GAP_MS} ms")
    return found


def _firmware(value: Any) -> str:
    """A number as well, and without the last zero."""
    text = str(value) if isinstance(value, float) else value
    short = [name for name in FIRMWARES if name.removesuffix("0") == text]
    return short[0] if short else word(*FIRMWARES)(text)


def _variant(value: Any) -> str:
    return word(*(v.name for v in VARIANTS))(value.upper().removeprefix("M1486") if isinstance(value, str) else value)


def _address(value: Any) -> int:
    if isinstance(value, str) and len(value) == 1 and value in "0123456789ABCDEFabcdef":
        return int(value, 16)
    return whole(0, 15)(value)


_CONTACT = _optional(word("NO", "NC"), "contact", "NO (closed while on) or NC (open while on)", "NO")
_JOIN = _optional(
    word("parallel", "series"), "join", "contacts of one input: parallel (1 while any is closed) or series (while all are)"
)
_BOUNCE = (
    _optional(time_value, "bounce", "how long the contact bounces, such as '3 ms'", 0),
    _optional(whole(1, 100), "bounces", "how often it opens again meanwhile", 3),
)

SEED = whole(0, 2**63 - 1)

KEYS: Mapping[str, tuple[Key, ...]] = {
    "world": (
        _optional(text_value, "name", "a name for people", "world"),
        _optional(SEED, "seed", "where all chance comes from", 0),
    ),
    "line": (
        Key("name", name_value, "how controllers and scripts name it"),
        _optional(word("modbus", "m1486"), "kind", "modbus (MIC488) or m1486", "modbus"),
        _optional(
            whole(300, 1_000_000),
            "baud",
            "bit/s; default that of the first controller, the highest of the chips",
        ),
        _optional(
            word("real", "strict", "off"),
            "timing",
            "real: characters take their time; strict (modbus): and a pause above 750 us drops a frame; off",
            "off",
        ),
        _optional(_address_text, "tcp", "HOST:PORT for live clients (Modbus TCP, or raw characters)"),
        _optional(
            _gap,
            "gap",
            "silence in ms after which bytes of no frame are given up; default 0.75 on a serial port, else 20",
        ),
        _optional(_address_text, "rtu_tcp", "HOST:PORT for live clients of RTU over TCP"),
        _optional(_address_text, "rfc2217", "HOST:PORT of a network serial port (RFC 2217) for live clients"),
        _optional(text_value, "pty", "path of a pseudo terminal for a live client"),
        _optional(text_value, "serial", "a real serial port"),
    ),
    "mic488": (
        Key("name", name_value, "how the rest of the file names it"),
        _optional(name_value, "line", "the line it is on"),
        _optional(whole(1, MAX_UNIT), "unit", "slave address; default that of its configuration"),
        _optional(_firmware, "firmware", f"one of {', '.join(FIRMWARES)}", "1.70"),
        _optional(text_value, "config", "the vendor tool's .cfg file"),
        _optional(text_value, "program", "a WBC program for bank 0"),
        _optional(banks_value, "programs", "WBC programs by bank: ['a.prg', 'b.prg'] for 0 and 1, or { 3 = 'd.prg' }", ()),
        _optional(banks_value, "positions", "position tables by bank, as programs; 'a.csv' alone is for bank 0", ()),
        _optional(flag, "start", "whether the program starts at power-on", False),
        _optional(time_value, "statement_time", "what a statement of the program takes"),
        _optional(flag, "lenient", "holes of the register map read 0", False),
        _optional(_address_text, "vision", "HOST:PORT for records of a vision system ('N1 X12.5 Y-3 A90' and a line end)"),
        _optional(flag, "trigger_keeps", "whether a trigger keeps the values it uses; default that of its configuration, no"),
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
        _optional(text_value, "unit", "of its positions: mm, cm, m, degree, rev or anything; default mm, degree or its drive's"),
        _optional(
            _positive, "pulses_per_unit", "pulses (M1486: minimum microsteps) per unit; else by pitch, by revolution, by gear"
        ),
        _optional(_positive, "pitch", "units per motor revolution, instead of pulses_per_unit"),
        _optional(whole(1, 10**7), "pulses_per_rev", "pulses per motor revolution; default mot_resol; M1486: 64 × full_steps"),
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
        _optional(_positive, "period", "the zone comes again after each; default a turn of a rotary axis in degree or rev"),
        _optional(_not_negative, "hysteresis", "how much further it stays on", 0.0),
        _CONTACT,
        _JOIN,
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
        _optional(whole(4, 10_000), "full_steps", "full steps per revolution; default 200"),
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
        _JOIN,
        *_BOUNCE,
    ),
    "source": (
        Key("to", pin_name, "the analog input: MACHINE.AIN1 or AIN2", attribute="target"),
        _optional(word("constant", "ramp", "sine", "table"), "kind", "constant, ramp, sine or table", "constant"),
        _optional(number(), "value", "volts; of a sine its mean", 0.0),
        _optional(number(), "amplitude", "sine: volts", 0.0),
        _optional(_not_negative, "frequency", "sine: Hz", 1.0),
        _optional(number(), "phase", "sine: degrees", 0.0),
        _optional(points, "points", "table: [[seconds, volts], ...]", ()),
        _optional(number(), "begin", "ramp: volts at first", 0.0),
        _optional(number(), "end", "ramp: volts in the end", 0.0),
        _optional(time_value, "over", "ramp: how long it takes", 0, "ramp_time"),
        _optional(positive_time, "repeat", "ramp, table: begins anew after this time"),
        _optional(positive_time, "period", "how often the voltage is renewed", 10 * MILLISECOND),
    ),
    "event": (
        _optional(name_value, "name", "for the trace"),
        _optional(time_value, "at", "when"),
        _optional(positive_time, "every", "again and again"),
        _optional(text_value, "when", "a condition, such as 'x.position > 100'"),
        _optional(flag, "once", "when: only the first time the condition comes true", False),
        STEPS,
    ),
    "script": (
        Key("name", name_value, "for the trace"),
        _optional(time_value, "at", "when it begins", 0),
        _optional(whole(1, 10**9), "repeat", "how often all of it is done", 1),
        STEPS,
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
