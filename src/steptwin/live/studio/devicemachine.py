"""A machine that devices move: its description says what they move, and no world computes anything."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files.loader import is_recording, load_world
from steptwin.live.studio.models import FolderModels, models_of
from steptwin.subject.contract import Description
from steptwin.subject.describe import describe


@dataclass(frozen=True, slots=True)
class DeviceMachine:
    """A machine, some controllers of which are devices."""

    path: Path
    described: Description

    @property
    def parts(self) -> Description:
        """The machine without what only a world has: controllers, lines, buttons and commands."""
        return replace(self.described, controllers=(), lines=(), buttons=(), commands=())

    @property
    def models(self) -> FolderModels | None:
        return models_of(self.described, self.path)

    def check(self, connected: Description) -> None:
        """Raises `Misuse` where a device is of another kind than the controller whose place it takes."""
        sheets = {one.name: one.datasheet for one in self.described.controllers}
        for device in connected.controllers:
            there, described = device.datasheet, sheets[device.name]
            if there.kind != described.kind:
                raise Misuse(f"--device {device.name}=...: {there.title} is there, but {self.path} has {described.title}")


def read_machine(path: Path, devices: Sequence[tuple[str | None, str]]) -> DeviceMachine:
    """The machine at ``path``. ``devices``: their names and addresses. Raises `Misuse`."""
    if is_recording(path):
        raise Misuse(f"--device NAME=...: {path} is a recording; devices take places in a description (.toml)")
    with load_world(path, lambda text: sys.stderr.write(f"{text}\n"), keep_trace=False, keep_inputs=False) as world:
        machine = DeviceMachine(path, describe(world))
    there = [one.name for one in machine.described.controllers]
    for name, address in devices:
        if name not in there:
            given = address if name is None else f"{name}={address}"
            raise Misuse(f"--device {given}: its name must be that of a controller in {path}: {', '.join(there)}")
    return machine
