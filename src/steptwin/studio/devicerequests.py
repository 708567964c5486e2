"""Requests for one device that is connected: its settings, and its digital shadow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.controller import Nanos
from steptwin.devices.digitalshadow import ShadowState
from steptwin.fields import TIME, Meaning
from steptwin.studio.requesttype import request


@dataclass(frozen=True, slots=True)
class DeviceSettings:
    """The settings of a device as text."""

    controller: str
    text: str


_Device: TypeAlias = Annotated[str, Meaning("Of a device.")]


@request(
    "settings",
    KEEP,
    "What can be read and written in a device, as the text that is kept before the first write.",
    DeviceSettings,
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


@request("shadow_state", LOOK, "How a device and its digital shadow differ; null without one.", ShadowState | None)
@dataclass(frozen=True, slots=True)
class ReadDigitalShadow:
    controller: _Device
    after: Annotated[
        Nanos,
        Meaning("Only samples later than this, from the beginning of the digital shadow.", TIME, unit="ns", name="after_ns"),
    ] = 0


DeviceRequest: TypeAlias = ReadSettings | SetDigitalShadow | ReadDigitalShadow
