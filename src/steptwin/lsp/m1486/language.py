"""Programs of the M1486 in editors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from steptwin.errors import Misuse
from steptwin.lsp.files import relative
from steptwin.lsp.language import EditorLanguage, OtherTexts
from steptwin.lsp.m1486.analysis import M1486Analysis
from steptwin.lsp.positions import LineIndex
from steptwin.lsp.world.tables import text_of
from steptwin.m1486.lines import STEP_DIRECTION, Interface, interface
from steptwin.m1486.variants import DEFAULT, Variant, variant
from steptwin.simulation.kinds.m1486.table import DEFAULT_VARIANT


@dataclass(frozen=True, slots=True)
class ChipFiles:
    """An M1486 of a world that has a program."""

    variant: Variant
    interface: Interface
    program: str

    @property
    def files(self) -> tuple[str]:
        return (self.program,)


def chip_of(world: str, table: Mapping[str, Any]) -> ChipFiles | None:
    """The program of a chip, by its table in a description; None without one. Wrong values are left out."""
    program = text_of(table, "program")
    if program is None:
        return None
    try:
        kind = variant(str(table.get("variant", DEFAULT_VARIANT)))
    except Misuse:
        kind = variant(DEFAULT_VARIANT)
    try:
        drive = interface(str(table.get("interface", STEP_DIRECTION.name)))
    except Misuse:
        drive = STEP_DIRECTION
    return ChipFiles(kind, drive, relative(world, program))


class M1486Programs(EditorLanguage):
    name = "m1486"
    suffix = ".m1486"
    most_characters = 1 << 17
    """Many times what the chips of a line hold."""

    def around(self, session: OtherTexts, uri: str) -> tuple[Variant, Interface]:
        chip = next((one for one in session.controllers(ChipFiles) if one.program == uri), None)
        return (DEFAULT, STEP_DIRECTION) if chip is None else (chip.variant, chip.interface)

    def analyse(self, session: OtherTexts, uri: str, lines: LineIndex) -> M1486Analysis:
        return M1486Analysis(uri, lines, *self.around(session, uri))


M1486_PROGRAMS = M1486Programs()
