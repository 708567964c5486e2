"""Every field of every register, reviewed once against tables 3.1 and 3.2 and chapter 4 of the manuals: golden/registers.txt.

Regenerate with ``python tests/mic488/test_registers_golden.py`` and read the diff.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.mic488.registermap import DataType, Register, RegisterMap
from steptwin.mic488.registers import FIRMWARES, register_map

GOLDEN = Path(__file__).parent / "golden" / "registers.txt"


def line(chart: RegisterMap, first: Register) -> str:
    """A register, or all copies of one, in a line."""
    copies = [register for register in chart if register.key == first.key]
    places = " ".join(f"{register.name}={register.address}" for register in copies)
    return f"{first.key}: {places} | " + " | ".join(described(first))


def described(r: Register) -> list[str]:
    codes = "/".join(",".join(map(str, functions)) for functions in (r.reads, r.writes, r.accepts))
    units = "/".join(r.unit(data_type) for data_type in DataType)
    texts = ", ".join(f"{number:d} {text}" for number, text in r.values.items())
    return [
        " ".join(r.aliases), r.space.name, r.type.value, f"{r.cells}×{r.type.size}", f"functions {codes}", r.kind.value,
        r.effect.value, r.per.value, str(r.permitted), units, "word write" if r.word_write else "", texts,
        f"[{r.section}]", r.meaning,
    ]  # fmt: skip


def table(name: str) -> list[str]:
    chart = register_map(name)
    unit = chart.firmware
    memory = f"{unit.user_registers} user registers, stored {unit.stored_user_registers}"
    head = f"=== {unit.name}: manual {unit.manual}, base {unit.control_base}, {memory}, {unit.banks} banks"
    return [head, *(line(chart, register) for register in chart if register.index in (None, 1))]


def test_the_firmwares_are_those_of_the_file() -> None:
    heads = [line.split(":")[0] for line in GOLDEN.read_text(encoding="utf-8").splitlines() if line.startswith("===")]
    assert heads == [f"=== {name}" for name in FIRMWARES]


@pytest.mark.parametrize("name", FIRMWARES)
def test_registers_are_the_reviewed_ones(name: str) -> None:
    expected = GOLDEN.read_text(encoding="utf-8").split(f"=== {name}:")[1].split("\n===")[0]
    found = "\n".join(table(name)).removeprefix(f"=== {name}:")
    assert found.strip().splitlines() == expected.strip().splitlines()


if __name__ == "__main__":
    GOLDEN.write_text("\n".join("\n".join(table(name)) for name in FIRMWARES) + "\n", encoding="utf-8")
