"""The demo machine, which `steptwin studio` shows by default."""

from __future__ import annotations

import json
from pathlib import Path

from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.live.clients import is_taken
from steptwin.live.directory import runtime_directory
from steptwin.live.options import UpOptions
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.toml.addresses import Address
from steptwin.system import HAS_PTYS
from steptwin.textcodec import decode

FOLDER = Path(__file__).with_name("demo_machine")
NAME = "demo"
HOST = "127.0.0.1"
PORTS = (5020, 5021, 5022)
"""Ports of the bus over Modbus TCP and RTU over TCP, and of the chips, as those of `steptwin serve`."""


def demo_world(options: UpOptions, *, free_ports: bool = False) -> World:
    """At its beginning. ``free_ports``: on any free ports and without pseudo terminals, for tests."""
    text = describe_demo(free_ports=free_ports)
    files = {name: read_bytes(FOLDER / name) for name, _ in read_world(NAME, text).files()}
    return World.from_toml(
        text,
        files,
        name=NAME,
        seed=options.run.seed,
        overrides=options.run.overrides,
        keep_inputs=options.is_recorded,
        state=None if options.run.state is None else str(options.run.state),
    )


def describe_demo(*, free_ports: bool = False) -> str:
    """The description with its ports and pseudo terminals; where others have these, a free port and none."""
    text = decode(read_bytes(FOLDER / "demo.toml"), "demo.toml").text
    tcp, rtu_tcp, chips = (f"{HOST}:{0 if free_ports or is_taken(Address(HOST, port)) else port}" for port in PORTS)
    ptys = HAS_PTYS and not free_ports
    bus = {"pty": _pty("mic488") if ptys else None, "tcp": tcp, "rtu_tcp": rtu_tcp}
    line = {"pty": _pty("m1486") if ptys else None, "tcp": chips}
    for mark, keys in (("# ports of bus", bus), ("# ports of chips", line)):
        text = text.replace(mark, "\n".join(f"{key} = {json.dumps(value)}" for key, value in keys.items() if value is not None))
    return text


def _pty(name: str) -> str | None:
    path = runtime_directory() / name
    return None if path.exists() else str(path)
