"""``steptwin displays``: displays for Phoebus from the description of a world."""

from __future__ import annotations

from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files.textfiles import write_bytes
from steptwin.files.world import World
from steptwin.gateways.epics.displays import displays_of
from steptwin.gateways.points import registers_by_machine
from steptwin.subject.world import WorldSubject
from steptwin.system import reason
from steptwin.world.gateways import EpicsSpec


def write_displays(file: Path, folder: Path) -> list[Path]:
    """The files that have been written. Raises `Misuse` for a world without ``[gateway.epics]``."""
    world = World.load(file)
    spec = next((one for one in world.spec.gateways if isinstance(one, EpicsSpec)), None)
    if spec is None:
        raise Misuse(f"{file} has no [gateway.epics], whose records displays show")
    description = WorldSubject(world).description
    texts = displays_of(description, spec.prefix, registers_by_machine("[gateway.epics]", spec.registers, description))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Misuse(f"{folder}: {reason(error)}") from error
    written = [folder / name for name in texts]
    for path, text in zip(written, texts.values(), strict=True):
        write_bytes(path, text.encode())
    return written
