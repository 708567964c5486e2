"""All errors in the description of a world and in the files that it names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from steptwin.diagnostics import Diagnostic, in_order
from steptwin.errors import Misuse
from steptwin.world.blueprint import Blueprint
from steptwin.world.description import describe
from steptwin.world.pieces import is_piece
from steptwin.world.plant import Plant
from steptwin.world.reader import TomlText, WorldError

LONGEST_MESSAGE = 500
"""Limit of a message, in characters: the errors in a program that a description names are many, and shown in the program too."""


def diagnose(name: str, text: str, read: Callable[[str], bytes]) -> Sequence[Diagnostic]:
    """``read`` gives the content of a file by the name it has in the text. Never raises."""
    files: dict[str, bytes] = {}

    def keep(file: str) -> bytes:
        files[file] = read(file)
        return files[file]

    try:
        if is_piece(TomlText(name, text)):
            return ()  # what it is depends on what uses it
        spec = describe(name, text, read=keep)
    except WorldError as error:
        return error.findings
    try:
        for file, key in spec.files():
            try:
                _ = files.get(file) or keep(file)
            except Misuse as error:
                spec.text.wrong(key, "D009", str(error))
        Plant(Blueprint(spec, files), keep_trace=False, keep_inputs=False)
    except WorldError as error:
        return [_short(finding) for finding in error.findings]
    return [_short(finding) for finding in in_order(spec.text.findings)]


def _short(finding: Diagnostic) -> Diagnostic:
    message = finding.message
    return finding if len(message) <= LONGEST_MESSAGE else replace(finding, message=f"{message[:LONGEST_MESSAGE]}…")
