"""Descriptions of worlds: `WORLDS`. They are run by `steptwin.languages.run_world`, with options of their own."""

from __future__ import annotations

from pathlib import Path

import steptwin.services  # noqa: F401  their tables are checked, too
from steptwin.diagnostics import SourceText
from steptwin.files.world import read_beside
from steptwin.languages.contract import CheckReport, FileLanguage, GivenOptions
from steptwin.simulation.world.check import diagnose


class Worlds(FileLanguage):
    name = "world"
    title = "worlds"
    suffixes = (".toml",)

    def check(self, source: SourceText, options: GivenOptions) -> CheckReport:
        folder = Path(source.name).parent
        found = diagnose(source.name, source.text, lambda name: read_beside(folder, name))
        return CheckReport(list(found.findings), companions=[(file, list(of)) for file, of in found.files])


WORLDS = Worlds()
