"""``steptwin registers``: the table for people, for programs and for the reference page."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.cli.registers import as_csv, as_data, as_markdown, as_text
from steptwin.errors import Misuse
from steptwin.mic488.registers import DEFAULT_FIRMWARE, FIRMWARES, register_map

PAGE = Path(__file__).parents[2] / "docs/reference/mic488-registers.md"


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["registers", "mic488", *arguments], catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_piped_it_is_plain_text_of_one_line_per_register() -> None:
    lines = printed("--firmware", "1.23").splitlines()
    assert lines[0].split() == ["address", "name", "type", "read", "write", "unit", "permitted", "meaning"]
    assert len(lines) == 1 + len(register_map("1.23"))
    assert "1036     M1_ACC             REAL/DINT       3 (03h)  16 (10h)           u/s²  > 0" in "\n".join(lines)
    (jog,) = [line for line in lines if " JOG_SPEED " in line]
    assert jog.split()[:8] == ["1017", "JOG_SPEED", "REAL", "6", "(06h),", "16", "(10h)", "u/s"]


def test_the_default_is_the_default_firmware() -> None:
    assert printed() == as_text(register_map(DEFAULT_FIRMWARE))


def test_the_help_names_every_firmware() -> None:
    shown = CliRunner().invoke(app, ["registers", "--help"], env={"COLUMNS": "200", "NO_COLOR": "1"}).stdout
    for name in FIRMWARES:
        assert name in shown


def test_an_unknown_firmware_names_the_permitted_ones() -> None:
    with pytest.raises(Misuse, match=r"unknown firmware '1.50'; permitted: 1\.23, 1\.40, 1\.70"):
        CliRunner().invoke(app, ["registers", "mic488", "--firmware", "1.50"], catch_exceptions=False)


def test_csv_has_a_record_for_each_register() -> None:
    records = list(csv.DictReader(io.StringIO(printed("--firmware", "1.70", "--format", "csv"))))
    assert [record["name"] for record in records] == [register.name for register in register_map("1.70")]
    position = next(record for record in records if record["name"] == "M2_POS_ACT")
    assert {name: position[name] for name in ("address", "axis", "type", "read_functions", "write_functions", "unit")} == {
        "address": "10022",
        "axis": "2",
        "type": "REAL/DINT",
        "read_functions": "3",
        "write_functions": "16",
        "unit": "u",
    }
    kind = next(record for record in records if record["name"] == "DATA_TYPE")
    assert (kind["values"], kind["minimum"], kind["maximum"]) == ("0=REAL; 1=DINT", "0", "1")
    assert (kind["write_functions"], kind["manual_write_functions"]) == ("6 16", "6")


def test_json_says_the_same() -> None:
    records = json.loads(printed("--format", "json"))
    assert records == as_data(register_map())
    acceleration = next(record for record in records if record["name"] == "M1_ACC")
    assert (acceleration["minimum"], acceleration["minimum_excluded"], acceleration["maximum"]) == (0, True, None)
    user = next(record for record in records if record["name"] == "USER_REGISTER")
    assert (user["address"], user["count"], user["axis"]) == (0, 2000, None)
    assert as_csv(register_map()).count("\n") == len(records) + 1


def test_golden_lines_of_the_page() -> None:
    page = as_markdown(register_map("1.70")).splitlines()
    assert page[:3] == [
        "### Coils",
        "",
        "| address | name | type | read | write | unit | permitted | meaning |",
    ]
    # What stands between the address and the meaning of a coil.
    coil = "BIT |  | 5 (05h) |  | ON, OFF"
    assert [line for line in page if "_EN`" in line or "`USER_REG_ZERO`" in line or "`Mx_JOG_MINUS`" in line] == [
        f"| 2000…2003 | `Mx_EN` | {coil} | Enable output of axis Mx: ON switches the drive on, OFF switches it off. |",
        f"| 2009, 2011, 2013, 2015 | `Mx_JOG_MINUS` | {coil} | While ON, axis Mx moves in the negative direction at JOG_SPEED. |",
        f"| 2102 | `USER_REG_ZERO` (also `USER_REG_RESET`) | {coil} | Writing ON sets user registers 1000–1999 to 0. |",
    ]
    assert "| 10001 | `PROG_BANK_SEL` | WORD | 3 (03h) | 6 (06h), 16 (10h) |  | 0…5 | Program bank the next start runs. |" in page
    assert (
        "| 10044, 10046, 10048, 10050 | `Mx_DEC` | REAL/DINT | 3 (03h) | 16 (10h) | u/s² | > 0 |"
        " Deceleration of axis Mx in position mode. |" in page
    )
    assert (
        "| 10009 | `M_STATUS` | WORD | 3 (03h) |  |  |  | Status of the controller:"
        " 0 ok, 1 drive position error, 2 program error, 3 Modbus master communication error. |" in page
    )


@pytest.mark.parametrize("name", FIRMWARES)
def test_the_page_lists_every_address_once(name: str) -> None:
    """Each register of the map is in exactly one line of the tables."""
    listed: list[int] = []
    for line in as_markdown(register_map(name)).splitlines():
        cell = line.split(" | ")[0].removeprefix("| ")
        if span := re.fullmatch(r"(\d+)…(\d+)", cell):
            listed += range(int(span[1]), int(span[2]) + 1)
        elif re.fullmatch(r"\d+(, \d+)*", cell):
            listed += map(int, cell.split(", "))
    expected = [address for r in register_map(name) for address in (range(r.address, r.last + 1) if r.cells > 1 else [r.address])]
    assert sorted(listed) == sorted(expected)


def test_the_reference_page_prints_every_firmware() -> None:
    """The page holds no table of its own: it runs the command while the documentation is built."""
    page = PAGE.read_text()
    commands = re.findall(r"^```\{steptwin\} (.+)$", page, re.MULTILINE)
    assert [command.split() for command in commands] == [
        ["registers", "mic488", "--firmware", name, "--format", "md"] for name in reversed(list(FIRMWARES))
    ]
    assert "|" not in page


def test_tags_for_panels_have_the_address_in_every_way_of_counting() -> None:
    tags = {tag["tag"]: tag for tag in csv.DictReader(io.StringIO(printed("--format", "tags")))}
    assert len(tags) == len(register_map("1.70"))
    assert tags["M1_POS_ACT"] == {
        "tag": "M1_POS_ACT",
        "data_type": "REAL",
        "access": "RW",
        "area": "4x holding register",
        "address_0": "10020",
        "address_1": "10021",
        "reference": "410021",
        "registers": "2",
        "word_order": "low word first",
        "unit": "u",
        "minimum": "",
        "maximum": "",
        "comment": tags["M1_POS_ACT"]["comment"],
    }
    expected = {
        "M1_EN": ("002001", "BOOL", "W"),
        "IN1": ("105001", "BOOL", "R"),
        "OUT1": ("006001", "BOOL", "RW"),
        "M1_STATUS": ("410011", "WORD", "R"),
    }
    assert {name: (tags[name]["reference"], tags[name]["data_type"], tags[name]["access"]) for name in expected} == expected
    assert {tag["word_order"] for tag in tags.values() if tag["registers"] == "2"} == {"low word first"}
    assert {tag["word_order"] for tag in tags.values() if tag["registers"] == "1"} == {""}


def test_the_addresses_on_the_page_for_panels_are_those_of_the_tags() -> None:
    page = (PAGE.parents[1] / "hmi.md").read_text()
    tags = {tag["tag"]: tag for tag in csv.DictReader(io.StringIO(printed("--format", "tags")))}
    for column, line in (("address_0", "address from 0"), ("address_1", "address from 1"), ("reference", "reference with area")):
        (row,) = [row for row in page.splitlines() if row.startswith(f"| {line}")]
        assert [cell.strip() for cell in row.split("|")[2:-1]] == [tags[name][column] for name in ("M1_POS_ACT", "M1_EN", "IN1")]
