"""Data sheets and tables of the M1486, every field, reviewed once against the manual: golden/tables.txt.

Regenerate with ``PYTHONPATH=tests/support python tests/m1486/test_datasheet.py`` and read the diff.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from sheets import line, missing, sheet_lines

from steptwin.jsonvalues import to_json
from steptwin.m1486 import findings, functions, lines, registers, variants
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.datasheet import datasheet, datasheet_of
from steptwin.m1486.variants import DEFAULT, VARIANTS, variant

GOLDEN = Path(__file__).parent / "golden" / "tables.txt"
OTHERS = [v for v in VARIANTS if v is not DEFAULT]


def shown(row: functions.AuxiliaryFunction | registers.ChipRegister) -> str:
    """Without what commands do to the chip, which `test_commanduse` compares with it."""
    return line({name: value for name, value in to_json(row).items() if name not in ("acts_on", "state")})


def everything() -> dict[str, list[str]]:

    default = sheet_lines(datasheet_of(DEFAULT))
    return {
        "variants": list(map(line, variants.VARIANTS)),
        "functions": list(map(shown, functions.TABLE)),
        "interfaces": [str(interface) for interface in lines.INTERFACES],
        "registers": list(map(shown, registers.REGISTERS)),
        "findings": [f"{row.code} {row.severity.value}, {row.title}: {row.meaning}" for row in findings.TABLE],
        f"data sheet of {DEFAULT.name}": default,
        **{f"other lines of {v.name}": [row for row in sheet_lines(datasheet_of(v)) if row not in default] for v in OTHERS},
        **{f"not in {v.name}": missing(datasheet_of(DEFAULT), datasheet_of(v)) for v in OTHERS},
    }


def test_tables_are_the_reviewed_ones() -> None:
    texts = GOLDEN.read_text(encoding="utf-8").split("=== ")[1:]
    expected = {name: lines for name, *lines in (text.rstrip().splitlines() for text in texts)}
    found = everything()
    assert found.keys() == expected.keys()
    for name, rows in found.items():
        assert rows == expected[name]


@pytest.mark.parametrize("name", ["A", "E2"])
def test_a_chip_has_the_data_sheet_of_its_type(name: str) -> None:
    sheet = datasheet(M1486Chip(variant(name)))
    assert (sheet.kind, sheet.title, sheet.variant) == ("m1486", "M1486", name)


if __name__ == "__main__":
    GOLDEN.write_text("\n".join("\n".join([f"=== {name}", *rows]) for name, rows in everything().items()) + "\n", "utf-8")
