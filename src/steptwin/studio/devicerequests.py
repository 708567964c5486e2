"""Requests for one device that is connected: its settings, and a twin beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.machine import Nanos
from steptwin.studio.requestrow import NOTHING, RequestRow
from steptwin.studio.shapes import MOMENT
from steptwin.subject.fields import FLAG, TEXT, TIME, Field, Schema
from steptwin.subject.shapes import members


@dataclass(frozen=True, slots=True)
class ReadSettings:
    """The settings of a device, to be kept."""

    machine: str


@dataclass(frozen=True, slots=True)
class SetShadow:
    """Puts a twin beside a device, or removes it."""

    machine: str
    on: bool = True


@dataclass(frozen=True, slots=True)
class ReadShadow:
    """How a device and the twin beside it differ."""

    machine: str
    after: Nanos


DeviceRequest: TypeAlias = ReadSettings | SetShadow | ReadShadow

_TEXT: Schema = {"type": "string"}
_WHOLE: Schema = {"type": "integer"}
_NUMBER: Schema = {"type": "number"}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


def _list(schema: Schema) -> Schema:
    return {"type": "array", "items": schema}


_DIFFERENCE = members(
    {
        "at_ns": {**MOMENT, "description": "Since when, from the beginning of the shadow, as decimal text [ns]"},
        "what": {**_TEXT, "description": "An axis or a register."},
        "device": _NUMBER,
        "twin": _NUMBER,
    }
)
_SAMPLE: Schema = {
    "type": "array",
    "items": _or_null(_NUMBER),
    "minItems": 4,
    "maxItems": 4,
    "description": "Time from the beginning [s], position of the device, of the twin, tolerance; null: not compared.",
}
_AXIS = members({"axis": _WHOLE, "name": _TEXT, "unit": _TEXT, "first": _or_null(_DIFFERENCE), "samples": _list(_SAMPLE)})
_SHADOW = members(
    {
        "machine": _TEXT,
        "axes": _list(_AXIS),
        "registers": {**_list(_DIFFERENCE), "description": "Those that differ now."},
        "compared": {**_WHOLE, "description": "Registers that are compared at rest."},
        "first": {**_or_null(_DIFFERENCE), "description": "The first difference of all."},
        "problems": {**_list(_TEXT), "description": "Commands that the twin refused."},
    }
)
_MACHINE = Field("machine", TEXT, "Of a device.")

OF_DEVICES = (
    RequestRow(
        "settings",
        ReadSettings,
        KEEP,
        "What can be read and written in a device, as the text that is kept before the first write.",
        members({"machine": _TEXT, "text": _TEXT}),
        (_MACHINE,),
    ),
    RequestRow(
        "shadow",
        SetShadow,
        KEEP,
        "Put a twin beside a device at rest, which is given the same commands from then on, or remove it. Of the device it only "
        "reads.",
        NOTHING,
        (_MACHINE, Field("on", FLAG, "Whether there is to be one.", True)),
    ),
    RequestRow(
        "shadow_state",
        ReadShadow,
        LOOK,
        "How a device and the twin beside it differ; null without one.",
        _or_null(_SHADOW),
        (_MACHINE, Field("after_ns", TIME, "Only samples later than this, from the beginning of the shadow.", 0, "ns", "after")),
    ),
)
