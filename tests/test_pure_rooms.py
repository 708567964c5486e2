"""The pure packages run where there are no compiled wheels, clocks, sockets or threads, as in a browser."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from pure_packages import packages_up_to, pure_packages

PURE = pure_packages()
BLOCKED = (
    "fastcrc", "numpy", "serialx", "typer", "rich",
    "asyncio", "concurrent", "multiprocessing", "queue", "select", "selectors", "signal", "socket", "ssl", "subprocess",
    "threading", "termios", "fcntl", "resource", "pty",
)  # fmt: skip
PROJECTIONS = {"steptwin.motion.pulses"}
"""Lists of pulses for exports: arrays, which need numpy."""
EXAMPLES = Path(__file__).parent.parent / "examples"

SCRIPT = """
import sys

for name in [name for name in sys.modules if name.partition(".")[0] in BLOCKED]:
    del sys.modules[name]

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in BLOCKED:
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Block())

import importlib, pkgutil, pathlib

for package in PURE:
    root = importlib.import_module(f"steptwin.{package}")
    for module in pkgutil.walk_packages(root.__spec__.submodule_search_locations or (), f"steptwin.{package}."):
        if module.name not in PROJECTIONS:
            importlib.import_module(module.name)

from steptwin.wire.crc import crc16, table_crc16
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.world.simulation import Simulation

assert crc16 is table_crc16
examples = pathlib.Path(EXAMPLES)
text = (examples / "worlds/feeder.toml").read_text()
files = {name: (examples / "worlds" / name).read_bytes() for name in read_world("feeder.toml", text).files()}

simulation = Simulation(Blueprint(read_world("feeder.toml", text), files))
simulation.advance(20_000_000_000)
simulation.sync_all()
print(simulation.trace.digest())
print(sorted(name for name in sys.modules if name.partition(".")[0] in BLOCKED))
"""


def test_every_package_from_access_down_is_pure_but_those_that_ask_the_system() -> None:
    assert packages_up_to("access") - {"inputfiles", "system"} <= set(PURE)


def test_worlds_and_programs_run_without_wheels_clocks_sockets_and_threads() -> None:
    settings = f"PURE, BLOCKED, PROJECTIONS, EXAMPLES = {PURE!r}, {BLOCKED!r}, {PROJECTIONS!r}, {str(EXAMPLES)!r}\n"
    ran = subprocess.run([sys.executable, "-c", settings + SCRIPT], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    digest, loaded = ran.stdout.splitlines()
    assert loaded == "[]"
    from steptwin import World

    with World.load(EXAMPLES / "worlds/feeder.toml") as world:
        world.advance(20_000_000_000)
        world.sync_all()
        assert digest == world.trace.digest()
