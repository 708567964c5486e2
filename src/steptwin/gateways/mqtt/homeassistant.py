"""Discovery for Home Assistant: one device for each controller, with sensors, binary sensors and buttons that stop it.

The form is that of *device discovery* (Home Assistant 2024.11 and newer): one retained message for each device.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from steptwin import __version__
from steptwin.gateways.mqtt.connection import Publication
from steptwin.gateways.mqtt.jsontopics import DO, ONLINE, Group, Topics, encode
from steptwin.gateways.points import GatewayPoint, PointType
from steptwin.subject.contract import ControllerDescription, Description

PREFIX = "homeassistant"
_CLASSES: Mapping[str, str] = {
    "mm": "distance",
    "cm": "distance",
    "m": "distance",
    "mm/s": "speed",
    "m/s": "speed",
    "V": "voltage",
    "s": "duration",
    "bit/s": "data_rate",
}
"""Device classes whose units these are."""
_UNITS: Mapping[str, str] = {"degree": "°", "degree/s": "°/s"}


def discovery(topics: Topics, description: Description) -> Iterator[Publication]:
    """Retained messages, one for each controller."""
    for part in description.controllers:
        identity = _identity(f"{topics.base}/{part.name}")
        found = {
            "dev": {
                "ids": [identity],
                "name": f"{topics.name} {part.name}",
                "mf": "device" if part.is_real else "twin",
                "mdl": part.datasheet.title,
                "sw": part.datasheet.variant,
            },
            "o": {"name": "steptwin", "sw": __version__},
            "avty": [{"t": topics(ONLINE), "pl_avail": "true", "pl_not_avail": "false"}],
            "cmps": {**_values(identity, topics.groups[part.name]), **_buttons(identity, topics, part)},
        }
        yield Publication(f"{PREFIX}/device/{identity}/config", encode(found), qos=1, retain=True)


def _identity(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]", "_", text)


def _values(identity: str, groups: tuple[Group, ...]) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for group in groups:
        for point in group.points:
            key = _identity("_".join(point.path))
            found[key] = {**_component(point), "uniq_id": f"{identity}_{key}", "stat_t": group.topic}
    return found


def _component(point: GatewayPoint) -> dict[str, Any]:
    value = f"value_json['{point.path[-1]}']"
    name = " ".join(point.path).replace("_", " ")
    if point.type is PointType.TRUTH:
        shown = f"{{{{ 'None' if {value} is none else 'ON' if {value} else 'OFF' }}}}"
        return {"p": "binary_sensor", "name": name, "val_tpl": shown}
    found: dict[str, Any] = {"p": "sensor", "name": name, "val_tpl": f"{{{{ {value} }}}}"}
    if point.unit:
        found["unit_of_meas"] = _UNITS.get(point.unit, point.unit)
    if point.unit in _CLASSES:
        found["dev_cla"] = _CLASSES[point.unit]
    if point.type is PointType.NUMBER:
        found["stat_cla"] = "measurement"
    return found


def _buttons(identity: str, topics: Topics, part: ControllerDescription) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for one in part.takes:
        if one.command != "stop":
            continue
        axis = next((axis for axis in part.datasheet.axes if axis.number == one.axis), None)
        key = "stop" if axis is None else f"stop_{axis.name}"
        pressed = {"do": "stop", "controller": part.name} | ({} if axis is None else {"axis": axis.number})
        found[key] = {
            "p": "button",
            "name": "stop" if axis is None else f"stop {axis.name}",
            "uniq_id": f"{identity}_{key}",
            "cmd_t": topics(DO),
            "pl_prs": encode(pressed).decode(),
            "qos": 1,
        }
    return found
