"""The records of a subject, and their names: PREFIX, the controller and the path of what is in it, with colons between."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from steptwin.errors import Misuse
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.motorrecord import MotorRecord
from steptwin.gateways.epics.pointrecord import CommandRecord, PointRecord
from steptwin.gateways.epics.recordnames import commands_of, record_name
from steptwin.gateways.epics.records import Record
from steptwin.gateways.points import CLOCK, CLOCK_POINTS, GatewayPoint, points_of
from steptwin.subject.contract import ControllerDescription

LONGEST_NAME = 60
"""Characters of the name of a record."""


def make_records(
    prefix: str, subject: GatewaySubject, controllers: Mapping[str, EpicsController], registers: Mapping[str, list[str]]
) -> dict[str, Record]:
    """By name. ``controllers``: one for each controller, and one for the clock; ``registers``: further points of each.

    Raises `Misuse` for a name that is too long.
    """
    records: dict[str, Record] = {}
    for part in subject.description.controllers:
        points = points_of(part, subject.description, registers[part.name])
        records |= dict(_records(prefix, part, points, controllers[part.name]))
    records |= dict(_points(prefix, CLOCK, CLOCK_POINTS, controllers[CLOCK]))
    for name in records:
        if len(name) > LONGEST_NAME:
            raise Misuse(
                f"[gateway.epics]: {name} has {len(name)} characters: permitted for the name of a record are {LONGEST_NAME}"
            )
    return records


def _records(
    prefix: str, part: ControllerDescription, points: tuple[GatewayPoint, ...], controller: EpicsController
) -> Iterator[tuple[str, Record]]:
    for axis in part.datasheet.axes:
        name = record_name(prefix, part.name, axis.name)
        motor = MotorRecord(name, part, axis, controller)
        controller.records.append(motor)
        yield name, motor
    yield from _points(prefix, part.name, points, controller)
    for path, row in commands_of(part):
        name = record_name(prefix, part.name, *path)
        yield name, CommandRecord(name, row, controller)


def _points(
    prefix: str, owner: str, points: tuple[GatewayPoint, ...], controller: EpicsController
) -> Iterator[tuple[str, Record]]:
    for point in points:
        name = record_name(prefix, owner, *point.path)
        record = PointRecord(name, point, controller)
        controller.records.append(record)
        yield name, record
