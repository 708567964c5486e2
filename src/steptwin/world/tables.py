"""What the TOML file of a world may contain: every table has rows (`KEYS`), those of controllers in their kinds (`all_keys`).

The reader, the messages and the reference page take them from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, Nanos
from steptwin.world.kinds import KINDS, line_kinds
from steptwin.world.links import LINK_KEYS
from steptwin.world.reader import (
    Key,
    flag,
    name_value,
    number,
    optional,
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
from steptwin.world.sources import WAVEFORMS

MOST_GAP_MS = 10_000

_positive = number(0.0, above=True)
_not_negative = number(0.0)


def _gap(value: Any) -> Nanos:
    """Milliseconds, as the command line takes them, or a text such as ``"5 ms"``."""
    found = duration(value) if isinstance(value, str) else round(number(0.0, MOST_GAP_MS, above=True)(value) * MILLISECOND)
    if not 0 < found <= MOST_GAP_MS * MILLISECOND:
        raise Misuse(f"{value!r}: permitted are more than 0 and at most {MOST_GAP_MS} ms")
    return found


def _line_kind(value: Any) -> str:
    return word(*line_kinds())(value)


_CONTACT = optional(word("NO", "NC"), "contact", "NO (closed while on) or NC (open while on)", "NO")
_JOIN = optional(
    word("parallel", "series"), "join", "contacts of one input: parallel (1 while any is closed) or series (while all are)"
)
_BOUNCE = (
    optional(time_value, "bounce", "how long the contact bounces, such as '3 ms'", 0),
    optional(whole(1, 100), "bounces", "how often it opens again meanwhile", 3),
)

SEED = whole(0, 2**63 - 1)

KEYS: Mapping[str, tuple[Key, ...]] = {
    "world": (
        optional(text_value, "name", "a name for people", "world"),
        optional(SEED, "seed", "where all chance comes from", 0),
        optional(text_value, "trace", "what 'up' keeps of what happens: a FILE that grows, 'ring N' (records), or 'off'", "off"),
        optional(text_value, "state", "directory that keeps non-volatile memory; without it, memory ends with the world"),
    ),
    "line": (
        Key("name", name_value, "how controllers and scripts name it"),
        optional(_line_kind, "kind", "modbus (MIC488) or m1486", "modbus"),
        optional(
            whole(300, 1_000_000),
            "baud",
            "bit/s; default that of the first controller, the highest of the chips",
        ),
        optional(
            word("real", "strict", "off"),
            "timing",
            "real: characters take their time; strict (modbus): and a pause above 750 us drops a frame; off",
            "off",
        ),
        optional(
            _gap,
            "gap",
            "silence in ms after which bytes of no frame are given up; default 0.75 on a serial port, else 20",
        ),
        *LINK_KEYS,
    ),
    "axis": (
        Key("name", name_value, "how scripts and conditions name it"),
        Key("drive", pin_name, "what drives it: MACHINE.M1 to M4 of a MIC488, MACHINE.M1 of an M1486"),
        optional(word("linear", "rotary"), "kind", "linear or rotary", "linear"),
        optional(text_value, "unit", "of its positions: mm, cm, m, degree, rev or anything; default mm, degree or its drive's"),
        optional(
            _positive, "pulses_per_unit", "pulses (M1486: minimum microsteps) per unit; else by pitch, by revolution, by gear"
        ),
        optional(_positive, "pitch", "units per motor revolution, instead of pulses_per_unit"),
        optional(whole(1, 10**7), "pulses_per_rev", "pulses per motor revolution; default mot_resol; M1486: 64 × full_steps"),
        optional(flag, "inverted", "whether positive pulses go down", False),
        optional(pair, "travel", "[low, high]: hard stops"),
        optional(number(), "start", "where it stands when the world begins", 0.0),
        optional(_not_negative, "backlash", "play between motor and load", 0.0),
    ),
    "switch": (
        Key("to", pin_name, "the input: MACHINE.PIN", attribute="target"),
        optional(number(), "below", "on at and below this position"),
        optional(number(), "above", "on at and above this position"),
        optional(number(), "position", "on around this position, with width"),
        optional(_not_negative, "width", "how wide the zone around position is", 0.0),
        optional(_positive, "period", "the zone comes again after each; default a turn of a rotary axis in degree or rev"),
        optional(_not_negative, "hysteresis", "how much further it stays on", 0.0),
        _CONTACT,
        _JOIN,
        *_BOUNCE,
    ),
    "encoder": (
        optional(whole(-(10**9), 10**9), "counts_per_rev", "counts per motor revolution; negative: backwards"),
        optional(number(), "counts_per_unit", "counts per unit of the axis, for an encoder on the load"),
        optional(flag, "index", "whether channel C gives an index once per revolution", False),
        optional(number(), "offset", "position of an index", 0.0),
        optional(whole(1, 10**6), "index_width", "width of the index in pulses", 4),
        optional(word("motor", "load"), "mount", "on the motor, or on the load behind the play", "motor"),
        optional(name_value, "follows", "another axis whose load turns it (electronic gear)"),
        optional(number(0.0, 1.0), "slip", "the part of the motion that its coupling loses", 0.0),
    ),
    "motor": (
        Key("torque", points, "pull-out torque: [[rev/min, N·m], ...] from 0 on; none above the last speed"),
        optional(_not_negative, "inertia", "kg·m² of rotor and load, at the motor", 0.0),
        optional(_not_negative, "mass", "kg moved by a linear axis", 0.0),
        optional(_not_negative, "friction", "N·m against motion", 0.0),
        optional(_not_negative, "friction_force", "N against motion of a linear axis", 0.0),
        optional(number(), "load", "constant N·m; positive pulls towards lower positions", 0.0),
        optional(number(), "force", "constant N on a linear axis; positive pulls towards lower positions", 0.0),
        optional(_not_negative, "start_speed", "rev/min it starts with at once and is caught at; default any, caught at rest"),
        optional(whole(4, 10_000), "full_steps", "full steps per revolution; default 200"),
    ),
    "wire": (
        Key("from", pin_name, "the output: MACHINE.PIN", attribute="source"),
        Key("to", pin_name, "the input: MACHINE.PIN", attribute="target"),
        optional(flag, "inverted", "whether the level is turned round", False),
        optional(time_value, "delay", "how much later it arrives", 0),
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
        optional(word(*WAVEFORMS), "kind", "constant, ramp, sine or table", "constant"),
        optional(number(), "value", "volts; of a sine its mean", 0.0),
        optional(number(), "amplitude", "sine: volts", 0.0),
        optional(_not_negative, "frequency", "sine: Hz", 1.0),
        optional(number(), "phase", "sine: degrees", 0.0),
        optional(points, "points", "table: [[seconds, volts], ...]", ()),
        optional(number(), "begin", "ramp: volts at first", 0.0),
        optional(number(), "end", "ramp: volts in the end", 0.0),
        optional(time_value, "over", "ramp: how long it takes", 0, "ramp_time"),
        optional(positive_time, "repeat", "ramp, table: begins anew after this time"),
        optional(positive_time, "period", "how often the voltage is renewed", 10 * MILLISECOND),
    ),
    "event": (
        optional(name_value, "name", "for the trace"),
        optional(time_value, "at", "when"),
        optional(positive_time, "every", "again and again"),
        optional(text_value, "when", "a condition, such as 'x.position > 100'"),
        optional(flag, "once", "when: only the first time the condition comes true", False),
        STEPS,
    ),
    "script": (
        Key("name", name_value, "for the trace"),
        optional(time_value, "at", "when it begins", 0),
        optional(whole(1, 10**9), "repeat", "how often all of it is done", 1),
        STEPS,
    ),
}


TABLES: Mapping[str, str] = {
    "world": "[world]",
    "line": "[[line]]",
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


def all_keys() -> dict[str, tuple[Key, ...]]:
    """The rows of every table, in the order of a description: its name and seed, lines, controllers, what is around them."""
    controllers = {kind.name: kind.keys for kind in KINDS.values()}
    return {"world": KEYS["world"], "line": KEYS["line"], **controllers, **KEYS}


def written(table: str) -> str:
    """How a table is written."""
    return TABLES.get(table, f"[[{table}]]")
