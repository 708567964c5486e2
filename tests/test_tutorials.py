"""Tutorials: what their pages show besides the blocks that `test_docs_run` runs."""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import serial
from pages import BIN, ROOT, blocks


def steptwin(line: str, directory: Path) -> str:
    words = [str(BIN / "steptwin"), *shlex.split(line)[1:]]
    return subprocess.run(words, cwd=directory, capture_output=True, text=True, check=False).stdout


def test_the_machine_grows_and_fails_as_its_page_says(tmp_path: Path) -> None:
    description = tmp_path / "machine.toml"
    command = ""
    for block in blocks("docs/tutorials/machine.md"):
        if block.language == "toml":
            description.write_text((description.read_text() if description.exists() else "") + block.code)
        elif block.language == "sh" and (block.reason is None or "test_tutorials" in block.reason):
            (command,) = block.commands()
            printed = steptwin(command, tmp_path)
            if " why " in command:
                state, cause, *_ = printed.splitlines()
                assert "is true, since 3.375881 s" in state
                assert cause.endswith("lift stalls: the motion needs more than the 1.54 N·m that the motor has at this speed")
        elif block.language == "text":
            events = [line for line in block.code.splitlines() if line and not line.startswith("20 s of world")]
            assert [line for line in events if line not in steptwin(command, tmp_path)] == []


def test_what_is_typed_to_the_chip_proves_itself(serve_m1486: Callable[..., Any]) -> None:
    typed = next(block.code.split() for block in blocks("docs/tutorials/m1486.md") if block.language == "text")
    twin = serve_m1486("--variant", "B", "--speed", "20")
    answers = b""
    with serial.Serial(str(twin.pty), 4800, timeout=20) as line:
        for text in typed:
            line.write(f"{text}\r".encode())
            answers += line.read(1) if text.startswith("u") else b""
    assert answers == b"@2"


def test_the_polish_page_has_the_blocks_and_numbers_of_the_english_one() -> None:
    def typed(page: str) -> list[str]:
        return [line.partition("  # ")[0].rstrip() for block in blocks(page) for line in block.code.splitlines()]

    def named(page: str) -> list[str]:
        """Options, tags, addresses, texts of steptwin."""
        return sorted(re.findall(r"`[^`\n]+`|\b\d[\d.e-]*\d\b|\b[A-Z]+\d?(?:_[A-Z]+)+\b", (ROOT / page).read_text()))

    assert typed("docs/tutorials/panel.pl.md") == typed("docs/tutorials/panel.md")
    assert named("docs/tutorials/panel.pl.md") == named("docs/tutorials/panel.md")
