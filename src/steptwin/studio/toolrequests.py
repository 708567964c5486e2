"""Requests for the motion calculator, configurations as forms, and captures of frames. They change nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from steptwin.access.roles import LOOK
from steptwin.calc import Formula, MovePart, RequiredSetting
from steptwin.diagnostics import Severity
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.studio.requestrow import RequestRow
from steptwin.subject.fields import (
    HEX,
    MOST_ITEMS,
    TEXT,
    TIME,
    Field,
    Schema,
    ValueType,
    choice,
    number,
    read_fields,
    whole,
    wrong,
)
from steptwin.subject.shapes import members, with_sentences
from steptwin.wire.pcapng import CapturedFrame

LONGEST_FILE = 48_000
"""Characters of a configuration; those of the vendor have 3000."""
MOST_FRAMES = 5000
"""Of a capture: as many as the page keeps."""


@dataclass(frozen=True, slots=True)
class ReadQuantities:
    """Requests the quantities of a move of an axis."""

    machine: str
    axis: int


@dataclass(frozen=True, slots=True)
class Calculate:
    """Calculates a move from its quantities."""

    machine: str
    axis: int
    given: Mapping[str, float]
    find: str | None = None


@dataclass(frozen=True, slots=True)
class ConvertGear:
    """Calculates pulses in each unit from the mechanics."""

    motor_steps: float
    microsteps: float
    ratio: float
    lead: float | None = None


@dataclass(frozen=True, slots=True)
class ReadConfiguration:
    """Requests the configuration of a controller as a form."""

    machine: str


@dataclass(frozen=True, slots=True)
class EditConfiguration:
    """Requests the form of a configuration text after changes."""

    machine: str
    text: str
    changes: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class MakeCapture:
    """Requests a capture file (pcapng) of frames."""

    frames: Sequence[CapturedFrame]


ToolRequest: TypeAlias = ReadQuantities | Calculate | ConvertGear | ReadConfiguration | EditConfiguration | MakeCapture

_TEXT: Schema = {"type": "string"}
_WHOLE: Schema = {"type": "integer"}
_NUMBER: Schema = {"type": "number"}
_FLAG: Schema = {"type": "boolean"}
_NUMBERS: Schema = {"type": "object", "additionalProperties": _NUMBER}
_TEXTS: Schema = {"type": "object", "additionalProperties": _TEXT}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


def _list(schema: Schema) -> Schema:
    return {"type": "array", "items": schema}


_LIMITS = members({"low": _or_null(_NUMBER), "high": _or_null(_NUMBER), "is_low_excluded": _FLAG})
_QUANTITY = members(
    {
        "name": _TEXT,
        "meaning": _TEXT,
        "unit": _TEXT,
        "pulses": {**_NUMBER, "description": "Pulses (per s, per s²) in one of its unit."},
        "limits": _LIMITS,
        "choices": _list(_WHOLE),
        "default": _or_null(_NUMBER),
        "same_as": {**_or_null(_TEXT), "description": "The quantity whose value it has where none is given."},
        "code": {**_TEXT, "description": "Register or command that sets it; empty where it is given with a motion."},
        "detail": {**_TEXT, "description": "The fact of the state that it is."},
        "source": _TEXT,
    }
)
_QUANTITIES = members({"title": _TEXT, "quantities": _list(_QUANTITY), "times": _list(_QUANTITY)})
_MOVE = with_sentences(
    {
        "title": _TEXT,
        "found": _or_null(_TEXT),
        "exact": {**_or_null(_NUMBER), "description": "Of what was found, before it was made what the controller takes."},
        "values": _NUMBERS,
        "units": _TEXTS,
        "times": _NUMBERS,
        "peak": _NUMBER,
        "reaches": {**_FLAG, "description": "Whether the peak is the velocity."},
        "parts": _list(members({name: _TEXT if name == "name" else _NUMBER for name in MovePart._fields})),
        "formulas": _list(with_sentences(dict.fromkeys(Formula._fields, _TEXT), "name", "text")),
        "notes": _list(_TEXT),
        "settings": _list(members({name: _NUMBER if name == "value" else _TEXT for name in RequiredSetting._fields})),
        "curve": {
            "type": "array",
            "items": {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3},
            "description": "Time [s], position, velocity.",
        },
    },
    lists=("notes",),
)
_FINDING = members(
    {
        **dict.fromkeys(("line", "column", "end_line", "end_column"), _WHOLE),
        "severity": {"enum": [one.value for one in Severity]},
        "code": _TEXT,
        "message": _TEXT,
        "hint": _or_null(_TEXT),
    }
)
_SETTING = members(
    {
        "name": _TEXT,
        "meaning": _TEXT,
        "unit": _TEXT,
        "text": {**_TEXT, "description": "As it is written; empty where it is not in the file."},
        "value": _NUMBER,
        "default": _NUMBER,
        "limits": _LIMITS,
        "is_whole": _FLAG,
        "choices": _TEXTS,
        "point": {**_TEXT, "description": "The point that has it at run time; empty without one."},
        "source": _TEXT,
    }
)
_FORM = members(
    {
        "name": {**_TEXT, "description": "Of the file."},
        "text": _TEXT,
        "sections": _list(members({"name": _TEXT, "title": _TEXT, "settings": _list(_SETTING)})),
        "diagnostics": _list(_FINDING),
        "is_file": {
            **_FLAG,
            "description": "false: no file; the text has what the registers of the controller show, and no more.",
        },
        "points": {
            **_NUMBERS,
            "description": "What points get from keys of the text, in the units that the controller has now. Without those that "
            "cannot be converted into them.",
        },
    }
)


def _file(value: Any) -> str:
    if not isinstance(value, str) or len(value) > LONGEST_FILE:
        raise wrong(value, _FILE.what)
    return value


A_FILE = Message("studio.a-file", "a text of at most {most} characters")
_FILE = ValueType(A_FILE(most=LONGEST_FILE), {"type": "string", "maxLength": LONGEST_FILE}, _file)


def _numbers(value: Any) -> Mapping[str, float]:
    form = number()
    return {name: form.read(one) for name, one in _table(value).items()}


EXPECTED_A_TEXT = Message("studio.expected-a-text", "{name}: {value!r}: expected a text")


def _texts(value: Any) -> Mapping[str, str]:
    found = _table(value)
    for name, one in found.items():
        if not isinstance(one, str):
            raise Misuse(EXPECTED_A_TEXT(name=name, value=one))
    return found


OBJECT_OF_MEMBERS = Message("studio.object-of-members", "an object with at most {most} members")


def _table(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, dict) or len(value) > MOST_ITEMS:
        raise wrong(value, OBJECT_OF_MEMBERS(most=MOST_ITEMS))
    return value


def _frames(value: Any) -> Sequence[CapturedFrame]:
    if not isinstance(value, list) or len(value) > MOST_FRAMES:
        raise wrong(value, _FRAMES.what)
    return [_frame(read_fields("frame", _OF_FRAME, _table(one))) for one in value]


def _frame(of: Mapping[str, Any]) -> CapturedFrame:
    return CapturedFrame(of["time_ns"], of["machine"], of["client"], of["direction"] == "in", of["data"])


_OF_FRAME = (
    Field("time_ns", TIME, "Virtual time."),
    Field("machine", TEXT, "The line."),
    Field("client", TEXT, "The client of the line."),
    Field("direction", choice("in", "out"), "in: to the controller."),
    Field("data", HEX, "Its bytes, in hexadecimal."),
)
_FRAMES = ValueType(
    f"a list of at most {MOST_FRAMES} frames",
    {"type": "array", "maxItems": MOST_FRAMES, "items": members({field.name: field.schema() for field in _OF_FRAME})},
    _frames,
)
_GIVEN = ValueType('{"QUANTITY": NUMBER, ...}', {**_NUMBERS, "maxProperties": MOST_ITEMS}, _numbers, dict)
_CHANGES = ValueType('{"SECTION.KEY": TEXT, ...}', {**_TEXTS, "maxProperties": MOST_ITEMS}, _texts, dict)
_MACHINE = Field("machine", TEXT, "The name of a machine.")
_AXIS = Field("axis", whole(1, 64), "The number of an axis.")
_RATIO = number(0.0, 1e6)

TOOLS = (
    RequestRow(
        "calculator",
        ReadQuantities,
        LOOK,
        "The quantities of a move of an axis, and the times of which one may be given in place of a quantity.",
        _QUANTITIES,
        (_MACHINE, _AXIS),
    ),
    RequestRow(
        "calculate",
        Calculate,
        LOOK,
        "A move from rest to rest, as the controller would plan it: its times, or with one time the quantity that is left out.",
        _MOVE,
        (
            _MACHINE,
            _AXIS,
            Field("given", _GIVEN, "Quantities by name, and a time at most."),
            Field("find", TEXT, "What a time determines; the one that is left out without.", None),
        ),
    ),
    RequestRow(
        "gear",
        ConvertGear,
        LOOK,
        "Pulses in each unit (GEAR), from the mechanics.",
        _NUMBERS,
        (
            Field("motor_steps", _RATIO, "Full steps in a revolution of the motor.", 200.0),
            Field("microsteps", _RATIO, "Pulses in a full step."),
            Field("ratio", _RATIO, "Revolutions of the motor in one of what it drives.", 1.0),
            Field("lead", _RATIO, "Travel in one revolution of what is driven; it turns without.", None, "mm"),
        ),
    ),
    RequestRow(
        "configuration",
        ReadConfiguration,
        LOOK,
        "The configuration of a controller as a form: sections, settings with meaning, unit and range, what is wrong. It is "
        "that of its file; without one, what its registers show.",
        _FORM,
        (_MACHINE,),
    ),
    RequestRow(
        "capture",
        MakeCapture,
        LOOK,
        "A capture file (pcapng) for Wireshark, of frames as events have them. Modbus TCP is in packets of TCP, serial lines "
        "are as captures of an RTAC.",
        members({"data": {**_TEXT, "contentEncoding": "base64"}}),
        (Field("frames", _FRAMES, "In their order."),),
    ),
    RequestRow(
        "edit_configuration",
        EditConfiguration,
        LOOK,
        "The form of a text of such a file, with other values in it. Nothing is written.",
        _FORM,
        (
            _MACHINE,
            Field("text", _FILE, "The file."),
            Field("changes", _CHANGES, "Values by SECTION.KEY, such as Axis0.Gear.", {}),
        ),
    ),
)
