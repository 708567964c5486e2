"""All errors and warnings in the description of a world and in the files that it names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from steptwin.diagnostics import Diagnostic, SourceText, in_order
from steptwin.errors import Misuse
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import describe
from steptwin.simulation.describe.endswitches import check_end_switches
from steptwin.simulation.describe.includes import is_include
from steptwin.simulation.describe.overlaps import check_overlaps
from steptwin.simulation.describe.reach import check_reach
from steptwin.simulation.toml.reader import TomlText, WorldError
from steptwin.simulation.world.simulation import Simulation

LONGEST_MESSAGE = 500
"""Limit of a message, in characters: the errors in a program that a description names are many, and shown in the program too."""


class Diagnosis(NamedTuple):
    """Findings in a description, and in each file of programs, positions and configurations that it names."""

    findings: Sequence[Diagnostic]
    files: Sequence[tuple[SourceText, Sequence[Diagnostic]]] = ()


def diagnose(name: str, text: str, read: Callable[[str], bytes]) -> Diagnosis:
    """``read`` gives the content of a file by the name it has in the text. Never raises."""
    files: dict[str, bytes] = {}

    def keep(file: str) -> bytes:
        files[file] = read(file)
        return files[file]

    try:
        if is_include(TomlText(name, text)):
            return Diagnosis(())  # what it is depends on what uses it
        spec = describe(name, text, read=keep)
    except WorldError as error:
        return Diagnosis(error.findings)
    blueprint: Blueprint | None = None
    try:
        for file, key in spec.files():
            try:
                _ = files.get(file) or keep(file)
            except Misuse as error:
                spec.text.wrong(key, "D009", str(error))
        blueprint = Blueprint(spec, files)
        objects = Simulation(blueprint, keep_trace=False, keep_inputs=False).objects
        check_overlaps(spec.text, objects)
        check_reach(spec.text, objects)
        check_end_switches(spec, objects)
        found: Sequence[Diagnostic] = in_order([*spec.text.findings, *spec.text.warnings])
    except WorldError as error:
        found = error.findings
    return Diagnosis([_short(finding) for finding in found], () if blueprint is None else blueprint.findings)


def _short(finding: Diagnostic) -> Diagnostic:
    message = finding.message
    return finding if len(message) <= LONGEST_MESSAGE else replace(finding, message=f"{message[:LONGEST_MESSAGE]}…")
