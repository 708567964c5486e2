"""What an import brings along: pure packages nothing heavy, the command line nothing that keeps `--help` waiting."""

from __future__ import annotations

import pkgutil
import subprocess
import sys

from pure_packages import pure_packages

import steptwin
from steptwin.cli import COMMANDS

PURE = pure_packages()
PROJECTIONS = {"steptwin.motion.pulses"}
HEAVY = {
    "anyio",
    "asyncio",
    "fastapi",
    "lsprotocol",
    "matplotlib",
    "numpy",
    "pyarrow",
    "pydantic",
    "pygls",
    "rich",
    "serialx",
    "starlette",
    "uvicorn",
    "uvloop",
}


def modules_of(*packages: str) -> list[str]:
    names = (module.name for module in pkgutil.walk_packages(steptwin.__path__, "steptwin."))
    wanted = tuple(f"steptwin.{package}." for package in packages)
    return [name for name in names if f"{name}.".startswith(wanted) and name not in PROJECTIONS]


def brought_by(modules: list[str]) -> set[str]:
    """The top-level modules that a fresh interpreter has loaded after importing ``modules``."""
    code = f"import sys, importlib\nfor name in {modules!r}: importlib.import_module(name)\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return {name.partition(".")[0] for name in run.stdout.split()}


def test_pure_packages_bring_nothing_heavy() -> None:
    modules = modules_of(*PURE)
    assert {"steptwin.controller", "steptwin.motion.planner"} <= set(modules)
    assert brought_by(modules) & HEAVY == set()


def test_the_help_of_a_command_brings_nothing_heavy() -> None:
    modules = [f"steptwin.cli.{name.replace('-', '_')}" for group in COMMANDS.values() for name in group]
    assert brought_by(modules) & HEAVY == set()


def test_the_help_of_all_commands_imports_none_of_them() -> None:
    code = "import sys; from typer.testing import CliRunner; from steptwin.cli import app; CliRunner().invoke(app, '--help'); "
    run = subprocess.run([sys.executable, "-c", code + "print(*sys.modules)"], capture_output=True, text=True, check=True)
    room = {name for name in run.stdout.split() if name.startswith("steptwin.cli.")}
    assert room == {f"steptwin.cli.{name}" for name in ("commandgroup", "completion", "optiongroups", "writtenfiles")}


def test_exports_bring_their_libraries_when_they_write() -> None:
    assert brought_by(["steptwin.files.export"]) & HEAVY == set()


def test_the_probe_sees_what_an_import_brings() -> None:
    assert "numpy" in brought_by(sorted(PROJECTIONS))
