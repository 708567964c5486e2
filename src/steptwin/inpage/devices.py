"""Devices beside the twin of a page, at serial ports of the browser. Imported when the first port is chosen."""

from __future__ import annotations

import time
from functools import partial
from typing import Protocol

from steptwin.datasheet import PointEffect
from steptwin.devices.connections import Computer, DeviceConnections
from steptwin.devices.device import LOOKS, DeviceSurroundings
from steptwin.drivers.address import parse_device
from steptwin.drivers.subject import DevicePart, RawEffect
from steptwin.errors import Refusal
from steptwin.inpage.connections import Page, report
from steptwin.inpage.host import PageTwin
from steptwin.inpage.serialports import SerialPage, SerialPorts
from steptwin.messages import Message
from steptwin.simulation.script import steps
from steptwin.subject import commands as command
from steptwin.subject.commands import Command, type_of

NO_END = Message(
    "inpage.no-end",
    "{command} was not sent: what it begins need not end by itself, and a page that stands still cannot stop it. From a page an "
    "axis moves to a target, by a distance, or as long as a button is held",
)
DOWNLOADS = Message("inpage.downloads", "{file}, among the downloads of the browser")


class DevicePage(Page, SerialPage, Protocol):
    """Messages to a page that has serial ports."""


def offer_devices(twin: PageTwin, page: DevicePage) -> SerialPorts:
    """Devices can be connected to ``twin`` from now on, at the ports that are added."""
    ports = SerialPorts(page)

    def keep(controller: str, text: str) -> str:
        file = f"{controller}-settings.json"
        page.saveText(file, text)
        return str(DOWNLOADS(file=file))

    around = DeviceSurroundings(clock=time.monotonic_ns, keep=keep, on_internal=partial(report, page), check=refuse_without_end)
    computer = Computer(ports=ports.listed, find=parse_device, line=lambda address: ports.endpoint(address.place, address.baud))
    twin.offer(DeviceConnections(twin.subject, around, computer))
    return ports


def refuse_without_end(part: DevicePart, wanted: Command) -> None:
    """Raises `Refusal` for what may begin a motion that does not end by itself: the browser may suspend a page, which then cannot
    stop it (ADR 12). What it may begin is not known of characters and of raw requests."""
    match wanted:
        case command.Move() | command.Enable():
            return
        case steps.Request():
            ends = part.effect_of(wanted) is not RawEffect.WRITE
        case steps.Write(values=values):
            effects = {point.path.upper(): point.effect for point in part.datasheet.points}
            harmless = (PointEffect.PARAMETER, PointEffect.ACTS)
            ends = all(effects.get(name.upper()) in harmless for _, name, _ in values)
        case _:
            ends = type(wanted) in LOOKS
    if not ends:
        raise Refusal(NO_END(command=type_of(wanted).name))
