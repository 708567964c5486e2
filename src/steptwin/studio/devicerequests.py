"""Requests for one device that is connected: its settings, and its digital shadow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.controller import Nanos
from steptwin.fields import TIME, Meaning, Schema
from steptwin.jsonvalues import MOMENT, NUMBER, TEXT, WHOLE, list_of, members, or_null
from steptwin.studio.requesttype import request

_DIFFERENCE = members(
    {
        "at_ns": {**MOMENT, "description": "Since when, from the beginning of the digital shadow, as decimal text [ns]"},
        "what": {**TEXT, "description": "An axis or a register."},
        "device": NUMBER,
        "twin": NUMBER,
    }
)
_SAMPLE: Schema = {
    "type": "array",
    "items": or_null(NUMBER),
    "minItems": 4,
    "maxItems": 4,
    "description": "Time from the beginning [s], position of the device, of the twin, tolerance; null: not compared.",
}
_AXIS = members({"axis": WHOLE, "name": TEXT, "unit": TEXT, "first": or_null(_DIFFERENCE), "samples": list_of(_SAMPLE)})
_SHADOW = members(
    {
        "controller": TEXT,
        "axes": list_of(_AXIS),
        "registers": {**list_of(_DIFFERENCE), "description": "Those that differ now."},
        "compared": {**WHOLE, "description": "Registers that are compared at rest."},
        "first": {**or_null(_DIFFERENCE), "description": "The first difference of all."},
        "problems": {**list_of(TEXT), "description": "Commands that the twin refused."},
    }
)


_Device: TypeAlias = Annotated[str, Meaning("Of a device.")]


@request(
    "settings",
    KEEP,
    "What can be read and written in a device, as the text that is kept before the first write.",
    members({"controller": TEXT, "text": TEXT}),
)
@dataclass(frozen=True, slots=True)
class ReadSettings:
    controller: _Device


@request(
    "shadow",
    KEEP,
    "Begin the digital shadow of a device at rest, a twin that gets the same commands from then on, or end it. It only "
    "reads from the device.",
)
@dataclass(frozen=True, slots=True)
class SetDigitalShadow:
    controller: _Device
    on: Annotated[bool, Meaning("Whether there is to be one.")] = True


@request("shadow_state", LOOK, "How a device and its digital shadow differ; null without one.", or_null(_SHADOW))
@dataclass(frozen=True, slots=True)
class ReadDigitalShadow:
    controller: _Device
    after: Annotated[
        Nanos,
        Meaning("Only samples later than this, from the beginning of the digital shadow.", TIME, unit="ns", name="after_ns"),
    ] = 0


DeviceRequest: TypeAlias = ReadSettings | SetDigitalShadow | ReadDigitalShadow
