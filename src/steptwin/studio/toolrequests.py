"""Requests for the motion calculator, configurations as forms, and captures of frames. They change nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeAlias

from steptwin.access.roles import LOOK
from steptwin.calc import Calculation, MoveQuantity
from steptwin.configuration import Section
from steptwin.controller import Nanos
from steptwin.diagnostics import Finding
from steptwin.errors import Misuse
from steptwin.fields import (
    HEX,
    MOST_ITEMS,
    TIME,
    AxisNumber,
    ControllerName,
    Meaning,
    Schema,
    ValueType,
    choice,
    fields_of,
    number,
    read_fields,
    wrong,
)
from steptwin.jsonvalues import NUMBER, TEXT, JsonForm, members
from steptwin.messages import Message
from steptwin.studio.requesttype import request
from steptwin.wire.pcapng import CapturedFrame

LONGEST_FILE = 48_000
"""Characters of a configuration; those of the vendor have 3000."""
MOST_FRAMES = 5000
"""Most frames of a capture: as many as the page keeps."""


_NUMBERS: Schema = {"type": "object", "additionalProperties": NUMBER}
_TEXTS: Schema = {"type": "object", "additionalProperties": TEXT}


@dataclass(frozen=True, slots=True)
class MoveQuantities:
    """The quantities of a move of an axis, and the times of which one may be given."""

    title: str
    quantities: tuple[MoveQuantity, ...]
    times: tuple[MoveQuantity, ...]


@dataclass(frozen=True, slots=True)
class ConfigurationForm:
    """A configuration file as a form."""

    name: Annotated[str, "Of the file."]
    text: str
    sections: tuple[Section, ...]
    diagnostics: tuple[Finding, ...]
    is_file: Annotated[bool, "false: no file; the text has what the registers of the controller show, and no more."]
    points: Annotated[
        Mapping[str, float],
        "What points get from keys of the text, in the units that the controller has now. Without those that cannot be converted "
        "into them.",
    ]


@dataclass(frozen=True, slots=True)
class CaptureFile:
    """A capture file, in base64."""

    data: Annotated[str, JsonForm({"type": "string", "contentEncoding": "base64"})]


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


@dataclass(frozen=True, slots=True)
class _Frame:
    time: Annotated[Nanos, Meaning("Virtual time.", TIME, name="time_ns")]
    controller: Annotated[str, Meaning("The line.")]
    client: Annotated[str, Meaning("The client of the line.")]
    direction: Annotated[str, Meaning("in: to the controller.", choice("in", "out"))]
    data: Annotated[bytes, Meaning("Its bytes, in hexadecimal.", HEX)]

    @property
    def captured(self) -> CapturedFrame:
        return CapturedFrame(self.time, self.controller, self.client, self.direction == "in", self.data)


_OF_FRAME = fields_of(_Frame)


def _frames(value: Any) -> Sequence[CapturedFrame]:
    if not isinstance(value, list) or len(value) > MOST_FRAMES:
        raise wrong(value, _FRAMES.what)
    return [_Frame(**read_fields("frame", _OF_FRAME, _table(one))).captured for one in value]


_FRAMES = ValueType(
    f"a list of at most {MOST_FRAMES} frames",
    {"type": "array", "maxItems": MOST_FRAMES, "items": members({field.name: field.schema() for field in _OF_FRAME})},
    _frames,
)
_GIVEN = ValueType('{"QUANTITY": NUMBER, ...}', {**_NUMBERS, "maxProperties": MOST_ITEMS}, _numbers, dict)
_CHANGES = ValueType('{"SECTION.KEY": TEXT, ...}', {**_TEXTS, "maxProperties": MOST_ITEMS}, _texts, dict)
_RATIO = number(0.0, 1e6)


@request(
    "calculator",
    LOOK,
    "The quantities of a move of an axis, and the times of which one may be given in place of a quantity.",
    MoveQuantities,
)
@dataclass(frozen=True, slots=True)
class ReadQuantities:
    controller: ControllerName
    axis: AxisNumber


@request(
    "calculate",
    LOOK,
    "A move from rest to rest, as the controller would plan it: its times, or with one time the quantity that is left out.",
    Calculation,
)
@dataclass(frozen=True, slots=True)
class Calculate:
    controller: ControllerName
    axis: AxisNumber
    given: Annotated[Mapping[str, float], Meaning("Quantities by name, and a time at most.", _GIVEN)]
    find: Annotated[str | None, Meaning("What a time determines; the one that is left out without.")] = None


@request("gear", LOOK, "Pulses in each unit (GEAR), from the mechanics.", Mapping[str, float])
@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertGear:
    motor_steps: Annotated[float, Meaning("Full steps in a revolution of the motor.", _RATIO)] = 200.0
    microsteps: Annotated[float, Meaning("Pulses in a full step.", _RATIO)]
    ratio: Annotated[float, Meaning("Revolutions of the motor in one of what it drives.", _RATIO)] = 1.0
    lead: Annotated[float | None, Meaning("Travel in one revolution of what is driven; it turns without.", _RATIO, unit="mm")] = (
        None
    )


@request(
    "configuration",
    LOOK,
    "The configuration of a controller as a form: sections, settings with meaning, unit and range, what is wrong. It is "
    "that of its file; without one, what its registers show.",
    ConfigurationForm,
)
@dataclass(frozen=True, slots=True)
class ReadConfiguration:
    controller: ControllerName


@request(
    "capture",
    LOOK,
    "A capture file (pcapng) for Wireshark, of frames as events have them. Modbus TCP is in packets of TCP, serial lines "
    "are as captures of an RTAC.",
    CaptureFile,
)
@dataclass(frozen=True, slots=True)
class MakeCapture:
    frames: Annotated[Sequence[CapturedFrame], Meaning("In their order.", _FRAMES)]


@request(
    "edit_configuration",
    LOOK,
    "The form of a text of such a file, with other values in it. Nothing is written.",
    ConfigurationForm,
)
@dataclass(frozen=True, slots=True)
class EditConfiguration:
    controller: ControllerName
    text: Annotated[str, Meaning("The file.", _FILE)]
    changes: Annotated[Mapping[str, str], Meaning("Values by SECTION.KEY, such as Axis0.Gear.", _CHANGES)] = field(
        default_factory=dict
    )


ToolRequest: TypeAlias = ReadQuantities | Calculate | ConvertGear | ReadConfiguration | MakeCapture | EditConfiguration
