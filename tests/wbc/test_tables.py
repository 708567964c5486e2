"""The tables of statements, registers, events and firmware; golden/tables.txt has their rows."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.wbc import findings
from steptwin.wbc.dialect import DEFAULT, DIALECTS, Dialect, dialect_for
from steptwin.wbc.events import BY_LABEL, BY_REGISTER, EVENTS
from steptwin.wbc.findings import FINDINGS
from steptwin.wbc.registers import PREDEFINED, REGISTERS, ROWS, parts
from steptwin.wbc.statements import FUNCTIONS, KEYWORDS, STATEMENTS


def test_a_code_has_one_meaning() -> None:
    with pytest.raises(ValueError, match=r"^code W101 is given twice$"):
        findings._row("W101", "another")
    assert FINDINGS["W101"] == findings.TRAILING


def test_no_name_has_two_meanings() -> None:
    meanings = [KEYWORDS, PREDEFINED.keys(), FUNCTIONS.keys(), BY_LABEL.keys()]
    for number, names in enumerate(meanings):
        assert not any(parts(name) for name in names)
        for others in meanings[number + 1 :]:
            assert names & others == set()


@pytest.mark.parametrize(
    ("name", "family", "number"),
    [
        ("OUT3", "OUT", 3),
        ("OUTPUTS", "OUTPUTS", 0),
        ("$I1999", "$I", 1999),
        ("CFGINT_TICK100", "CFGINT_TICK100", 0),
        ("CFGINT_IN8", "CFGINT_IN", 8),
        ("XENC1", "XENC", 1),
        ("OUT99", "OUT", 99),
        ("$I999999999", "$I", 999_999_999),
        ("LIMRM4", "LIMRM", 4),
    ],
)
def test_register_names(name: str, family: str, number: int) -> None:
    assert parts(name) == (ROWS[family], number)


@pytest.mark.parametrize("name", ["OUT", "OUTPUTS1", "CFGINT_TICK5", "$X1", "$I", "SPEED", "M", "M1A", "STATUS1", "$I9999999999"])
def test_names_that_are_no_register(name: str) -> None:
    assert parts(name) is None


def test_user_registers_end_with_the_firmware() -> None:
    ends = {
        firmware: tuple(ROWS[name].numbers(dialect)[-1] for name in ("$I", "$D", "$R")) for firmware, dialect in DIALECTS.items()
    }
    assert ends == {"1.23": (499, 498, 498), "1.40": (1999, 1998, 1998), "1.70": (1999, 1998, 1998)}


def test_executable_lines_by_firmware() -> None:
    assert {firmware: dialect.max_steps for firmware, dialect in DIALECTS.items()} == {"1.23": 1000, "1.40": 1000, "1.70": 4000}


@pytest.mark.parametrize(
    ("asked", "given"),
    [("1.23", "1.23"), ("1.25", "1.23"), ("1.40", "1.40"), ("1.69", "1.40"), ("1.70", "1.70"), ("2.0", "1.70")],
)
def test_firmware_between_generations(asked: str, given: str) -> None:
    assert dialect_for(asked) is DIALECTS[given]


@pytest.mark.parametrize("asked", ["1.22", "0.9", "", "new", "1", "1.2.3"])
def test_unknown_firmware(asked: str) -> None:
    with pytest.raises(Misuse, match=r"give 1\.23 or newer"):
        dialect_for(asked)


def test_features_by_firmware() -> None:
    def available(dialect: Dialect) -> set[str]:
        rows = [*REGISTERS, *STATEMENTS.values()]
        return {getattr(row, "key", None) or getattr(row, "keyword", "") for row in rows if not dialect.has(row.since)}

    first, second, last = map(available, DIALECTS.values())
    assert {"CFGINT_TICK100", "CFGINT_TICK1000", "CFGINT_M", "PULSE"} <= first == second
    assert last == set()
    assert DEFAULT.firmware == "1.70"


def test_wbc_20_ticks_carry_their_period() -> None:
    periods = {event.name: event.period // 1_000_000 for event in EVENTS if event.period}
    assert periods == {"TICK": 10, "TICK100": 100, "TICK1000": 1000}


def test_interrupt_labels() -> None:
    assert {f"INT_IN{n}" for n in range(1, 32)} | {"INT_MODBUS", "INT_TICK", "HARDINT_IN1", "INT_M4"} <= set(BY_LABEL)
    assert "INT_IN32" not in BY_LABEL
    assert all(parts(register) is not None for register in BY_REGISTER)
    assert sum(event.register is None for event in EVENTS) == 31 - 8


def test_predefined_names() -> None:
    assert PREDEFINED["RIS_FALL"] == PREDEFINED["RISFALL"] == 3
    assert PREDEFINED["HIGH"] == PREDEFINED["INT_HIGH"] == 4
    status = [
        "OFF",
        "ON",
        "SPEED",
        "POS_SEARCH",
        "POS_OK",
        "POS_ERROR",
        "HOMING",
        "FAULT",
        "POS_CORRECTION",
        "POS_LIML",
        "POS_LIMR",
    ]
    assert [PREDEFINED[f"M_{name}"] for name in status] == list(range(11))


def test_codes_tell_errors_from_warnings() -> None:
    assert {code[:2] for code in FINDINGS} == {"W1", "W2"}
    assert all(finding.severity.value == ("error" if code[1] == "1" else "warning") for code, finding in FINDINGS.items())
