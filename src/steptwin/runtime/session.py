"""Sessions: a world, its files, and everything that came from outside with its moments, in one file of JSON.

``steptwin replay FILE`` runs it again and compares the digest of what happened. Nothing else is needed for that.
"""

from __future__ import annotations

import json
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

from steptwin import __version__
from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.runtime.textfiles import read_bytes, write_bytes
from steptwin.runtime.world import World
from steptwin.world import script as do
from steptwin.world.actions import ACTIONS, Outside
from steptwin.world.description import read_world
from steptwin.world.faults import Fault, parse
from steptwin.world.plant import Given

FORMAT = 1

_STEPS = {kind.__name__: kind for kind in ACTIONS}


@dataclass(frozen=True, slots=True)
class Session:
    """A run of a world. ``digest`` is that of its trace at ``until``; ``firmware`` says what ran on each MIC488."""

    name: str
    text: str
    files: Mapping[str, bytes]
    firmware: Mapping[str, str]
    seed: int
    inputs: tuple[Given, ...]
    until: Nanos
    digest: str
    version: str = __version__

    def world(self) -> World:
        """The world at its beginning. Raises `WorldError`, and `Misuse` where seed or firmware are not the description's."""
        world = World(read_world(self.name, self.text), self.files)
        if world.spec.seed != self.seed:
            raise Misuse(f"the session says seed {self.seed!r}, its world {world.spec.seed}")
        ran = {name: view.device.firmware.name for name, view in world.mic488.items()}
        for name, firmware in self.firmware.items():
            if ran.get(name) != firmware:
                raise Misuse(
                    f"the session says that {name} runs firmware {firmware}, its world {ran.get(name, 'has no such machine')}"
                )
        return world

    def replay(self) -> World:
        """The world after all of it. Raises `Misuse` where inputs do not fit the world."""
        world = self.world()
        for time, what, settled in self.inputs:
            if time > self.until:
                raise Misuse(f"the session ends at {self.until} ns, before what came at {time} ns")
            _bring(world, time)
            if settled:
                world.advance(time)
            world.outside(what)
        _bring(world, self.until)
        world.settle_all()
        return world


def _bring(world: World, moment: Nanos) -> None:
    """To a moment, past those at which runs were stopped."""
    while world.now < moment:
        world.go_on()
        world.advance(moment)


def session_of(world: World) -> Session:
    """The session of a world up to now. What Python code did to the world is in it, the code is not."""
    world.settle_all()
    spec = world.spec
    return Session(
        spec.text.source.name,
        spec.text.source.text,
        world.files,
        {name: view.device.firmware.name for name, view in world.mic488.items()},
        spec.seed,
        tuple(world.inputs),
        world.now,
        world.trace.digest(),
    )


def save(session: Session, path: Path) -> None:
    """Raises `Misuse` when the file cannot be written."""
    data = {
        "steptwin_session": FORMAT,
        "version": session.version,
        "name": session.name,
        "seed": session.seed,
        "firmware": dict(session.firmware),
        "until_ns": session.until,
        "digest": session.digest,
        "world": session.text,
        "files": {name: b64encode(content).decode() for name, content in session.files.items()},
        "inputs": [
            {"time_ns": time, "settled": settled, "do": type(what).__name__, **_plain(what)}
            for time, what, settled in session.inputs
        ],
    }
    write_bytes(path, (json.dumps(data, ensure_ascii=False, indent=1) + "\n").encode())


def load(path: Path) -> Session:
    """Raises `Misuse` for a file that cannot be read or is no session."""
    try:
        data = json.loads(read_bytes(path))
        if data["steptwin_session"] != FORMAT:
            raise Misuse(f"{path} is a session of format {data['steptwin_session']}: this version reads {FORMAT}")
        return Session(
            data["name"],
            data["world"],
            {name: b64decode(content) for name, content in data["files"].items()},
            data["firmware"],
            data["seed"],
            tuple(_given(item) for item in data["inputs"]),
            data["until_ns"],
            data["digest"],
            data["version"],
        )
    except (LookupError, TypeError, ValueError) as error:
        raise error if isinstance(error, Misuse) else Misuse(f"{path} is no session of a world") from error


def _plain(what: Outside) -> dict[str, Any]:
    if isinstance(what, tuple):
        return {name: _value(value) for name, value in what._asdict().items()}
    return {field.name: _value(getattr(what, field.name)) for field in fields(what)} if is_dataclass(what) else {}


def _value(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"hex": value.hex()}
    if isinstance(value, Fault):
        return {"kind": value.kind.name, "name": value.name, **{key: _value(item) for key, item in value.given.items()}}
    if isinstance(value, tuple):
        return [_value(item) for item in value]
    return value


def _given(item: dict[str, Any]) -> Given:
    kind = _STEPS[item["do"]]
    values = {key: _back(value) for key, value in item.items() if key not in ("time_ns", "settled", "do")}
    if kind is do.SetFault:
        fault = {key: tuple(value) if isinstance(value, list) else value for key, value in item["fault"].items()}
        values = {"fault": parse({key: value for key, value in fault.items() if value != ""})}
    return Given(item["time_ns"], kind(**values), item["settled"])  # type: ignore[arg-type]


def _back(value: Any) -> Any:
    if isinstance(value, dict) and "hex" in value:
        return bytes.fromhex(value["hex"])
    if isinstance(value, list):
        return tuple(_back(item) for item in value)
    return value
