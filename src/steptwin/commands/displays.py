"""``steptwin displays``: displays for Phoebus from the description of a world, or from the file of ``steptwin bridge``."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from steptwin.commands.bridge import connections_of
from steptwin.devices.composite import CompositeSubject
from steptwin.errors import Misuse
from steptwin.files.textfiles import write_bytes
from steptwin.files.world import World
from steptwin.gateways.devicefile import DeviceFile, is_device_file, read_device_file
from steptwin.gateways.epics.displays import displays_of
from steptwin.gateways.points import registers_by_machine
from steptwin.inputfiles import read_bytes
from steptwin.subject.contract import Description
from steptwin.subject.events import Numbering
from steptwin.subject.world import WorldSubject
from steptwin.system import reason
from steptwin.textcodec import decode
from steptwin.world.gateways import EpicsSpec, GatewaySpec


def write_displays(file: Path, folder: Path) -> list[Path]:
    """The files that have been written. Raises `Misuse` for a file without ``[gateway.epics]``, `LineFailure` for a device that
    does not answer."""
    spec, description = described(file)
    texts = displays_of(description, spec.prefix, registers_by_machine("[gateway.epics]", spec.registers, description))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Misuse(f"{folder}: {reason(error)}") from error
    written = [folder / name for name in texts]
    for path, text in zip(written, texts.values(), strict=True):
        write_bytes(path, text.encode())
    return written


def described(file: Path) -> tuple[EpicsSpec, Description]:
    """The gateway of a file, and what it serves. Raises as `write_displays`."""
    text = decode(read_bytes(file), str(file)).text
    if is_device_file(str(file), text):
        wanted = read_device_file(str(file), text)
        spec = _epics(file, wanted.gateways)
        return spec, asyncio.run(_asked(wanted, file.parent))
    world = World.load(file)
    return _epics(file, world.spec.gateways), WorldSubject(world).description


def _epics(file: Path, gateways: Iterable[GatewaySpec]) -> EpicsSpec:
    spec = next((one for one in gateways if isinstance(one, EpicsSpec)), None)
    if spec is None:
        raise Misuse(f"{file} has no [gateway.epics], whose records displays show")
    return spec


async def _asked(wanted: DeviceFile, folder: Path) -> Description:
    """The description of the devices, as the bridge has it: what they are is asked of them."""
    subject = CompositeSubject(None, time.monotonic_ns, Numbering({}))
    connections = connections_of(subject, lambda _: None)
    try:
        for device in wanted.devices:
            await connections.open(device.beside(folder).address, device.name)
        return replace(subject.description, name=wanted.name)
    finally:
        await connections.close()
