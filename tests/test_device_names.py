"""Which modules above the kinds of controllers know a device: registered values, and tools that are for one device by nature.

The page of the studio asks for capabilities, which the service names.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "steptwin"
PAGE = ROOT / "studio-web" / "src"
DEVICES = ("mic488", "m1486", "wbc")
BELOW = (*DEVICES, "calc", "explain", "drivers", "verify", "simulation/kinds")
"""Packages of devices, and those with a folder or a module for each device and a table of them."""
TOOLS = {
    "bluesky/controllers.py": "the devices of Bluesky, a class for each controller",
    "bluesky/labelledprograms.py": "programs of the M1486 in Bluesky",
    "bluesky/programs.py": "programs of the MIC488 in Bluesky",
    "cli/build.py": "compiled images of WBC programs",
    "cli/calc.py": "options of each model of the calculator",
    "cli/commands.py": "reference page of the M1486's commands",
    "cli/commands_wbc.py": "reference page of the WBC language",
    "cli/completion.py": "firmwares and types for completion",
    "cli/decompile.py": "compiled images of WBC programs",
    "cli/device.py": "REAL numbers as text",
    "cli/diff.py": "transcripts of a MIC488",
    "cli/record.py": "positions of a MIC488 into its position table",
    "cli/registers.py": "register map of the MIC488",
    "languages/chips.py": "options of chips on a line",
    "live/studio/demo.py": "the world of serve mic488 --demo",
    "languages/__init__.py": "table of the languages",
    "languages/m1486.py": "registered value",
    "languages/wbc.py": "registered value",
    "languages/program_run.py": "REAL numbers as text",
    "languages/run_m1486.py": "what WBC and M1486 programs did, in words",
    "languages/run_wbc.py": "what WBC and M1486 programs did, in words",
    "cli/serve_m1486.py": "options of each twin",
    "cli/serve_mic488.py": "options of each twin",
    "languages/travels.py": "options of switches at a MIC488",
    "files/programbanks.py": "program banks of the MIC488",
    "files/programfiles.py": "program, table and configuration of a MIC488 under one name",
    "files/world.py": "world.mic488 and world.m1486 for Python programs, with types",
    "lsp/config.py": "analysis of configurations of the MIC488",
    "lsp/languages.py": "table of the languages",
    "lsp/table.py": "analysis of position tables of the MIC488",
    "lsp/textmate.py": "grammars of the two languages",
    "lsp/world/language.py": "table of the files of controllers",
    "pytest_plugin.py": "fixtures mic488 and m1486",
    "simulation/describe/generated_m1486.py": "generated worlds of serve and run",
    "simulation/describe/generated_mic488.py": "generated worlds of serve and run",
    "testing/__init__.py": "fixtures mic488 and m1486",
    "testing/devices.py": "fixtures mic488 and m1486",
    "testing/m1486.py": "fixtures mic488 and m1486",
    "testing/mic488.py": "fixtures mic488 and m1486",
    "testing/virtualtime.py": "fixtures mic488 and m1486",
    "testing/world.py": "fixtures mic488 and m1486",
}
"""A module that is not here gets what it needs from a registered value."""


def knows_a_device(module: Path) -> bool:
    for node in ast.walk(ast.parse(module.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module is not None and {*node.module.split(".")} & {*DEVICES}:
            return True
        if isinstance(node, ast.Constant) and node.value in DEVICES:
            return True
        if isinstance(node, ast.Attribute) and node.attr in ("mic488", "m1486"):
            return True
    return False


def test_modules_above_the_kinds_that_know_a_device_have_a_reason() -> None:
    above = {path.relative_to(SOURCE).as_posix(): path for path in sorted(SOURCE.rglob("*.py"))}
    own = (*BELOW, *(f"lsp/{device}" for device in DEVICES))
    found = {
        name for name, path in above.items() if not name.startswith(tuple(f"{one}/" for one in own)) and knows_a_device(path)
    }
    assert found == {*TOOLS}


NAMED = re.compile(rf"(?<!\.)\b({'|'.join(DEVICES)})\b|[\"'`](?i:{'|'.join(DEVICES)})[\"'`]")


def test_no_module_of_the_page_knows_a_device() -> None:
    """Names in sentences for people, such as M1486 in a help text, and suffixes of files are none."""
    modules = {path.relative_to(PAGE).as_posix(): path for path in PAGE.rglob("*") if path.suffix in (".ts", ".svelte")}
    modules.pop("lib/protocol/types.ts", None)  # generated
    found = {name for name, path in modules.items() if not name.endswith(".test.ts") and NAMED.search(path.read_text("utf-8"))}
    assert "panels/program/Program.svelte" in modules
    assert found == set()
