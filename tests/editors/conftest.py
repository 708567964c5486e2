"""The extension for VS Code: its folder, and node."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXTENSION = ROOT / "editors" / "vscode"
BUILDER = ROOT / "studio-web" / "build.py"

Script = Callable[..., str]


@pytest.fixture(scope="session")
def node() -> Path:
    """The folder of node; the packages of the extension are installed."""
    spec = importlib.util.spec_from_file_location("studio_web_build", BUILDER)
    assert spec is not None
    assert spec.loader is not None
    builder = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(builder)
    try:
        found: Path = builder.node_folder()
    except builder.NoNode as error:
        if os.environ.get("STEPTWIN_REQUIRE_PEERS") == "1":
            pytest.fail(str(error), pytrace=False)
        pytest.skip(str(error))
    subprocess.run([sys.executable, str(BUILDER), "install", str(EXTENSION)], check=True)
    return found


@pytest.fixture(scope="session")
def run_node(node: Path) -> Script:
    """``run_node("tests/x.mjs", text, NAME=value)`` gives the output of a module of the extension."""

    def run(module: str, text: str = "", *options: str, **variables: str) -> str:
        environment: Mapping[str, str] = {**os.environ, **variables}
        program = shutil.which("node", path=os.pathsep.join([str(node), os.environ.get("PATH", "")]))
        assert program is not None
        command = [program, *options, str(EXTENSION / module)]
        ran = subprocess.run(command, input=text, capture_output=True, encoding="utf-8", env=environment, check=False)
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return ran.stdout

    return run
