"""Messages are behaviour users rely on: every one of them stands in golden/, and a change of one deserves a review.

`programs.txt` has the mistakes, `other_languages.txt` what people bring along from other languages. Regenerate both with
``make golden ARGS=tests/wbc/test_check_golden.py`` and read the diff (notation: `golden_findings`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest
from golden_findings import shown

from steptwin.diagnostics import Diagnostic, SourceText
from steptwin.wbc.check import check
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.findings import FINDINGS
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.usage import Setup

GOLDEN = [Path(__file__).parent / "golden" / name for name in ("programs.txt", "other_languages.txt")]
CASE, RESULT = "=== ", "---"
NO_FINDING = "(no findings)"


@dataclass(frozen=True)
class Case:
    name: str
    text: str
    expected: str

    def settings(self, word: str) -> list[str]:
        """The ``@ word …`` lines of a case."""
        start = f"@ {word} "
        return [line.removeprefix(start) for line in self.text.splitlines() if line.startswith(start)]

    @property
    def program(self) -> str:
        return "".join(line for line in self.text.splitlines(keepends=True) if not line.startswith("@ "))

    def found(self) -> str:
        return shown(SourceText(self.name, self.program), self.check(self.program)) or NO_FINDING

    def check(self, text: str) -> list[Diagnostic]:
        rows = self.settings("row")
        table = parse_positions("".join(row + "\n" for row in rows))[0] if rows else None
        dialect = dialect_for(*(self.settings("firmware") or ["1.70"]))
        setup = None
        if self.settings("setup"):
            numbers = {key: float(value) for key, value in (pair.split("=") for pair in self.settings("setup")[0].split())}
            setup = Setup(
                gears=(100, numbers.get("gear2", 100), 1, 1),
                accelerations=(10, numbers.get("acc2", 10), 1, 1),
                decelerations=(10, numbers.get("dec2", 10), 1, 1),
                input_interrupts=tuple(int(numbers.get(f"in{n}", 0)) for n in range(1, 21)),
                homing_ends=tuple((numbers.get(f"kl{n}", 1) == 1, numbers.get(f"kr{n}", 1) == 1) for n in range(1, 5)),
                most_speed_p=64_000,
            )
        return check(text, table, setup, dialect).diagnostics


def read_cases(golden: Path) -> tuple[str, list[Case]]:
    head, *parts = golden.read_text(encoding="utf-8").split(CASE)
    cases = []
    for part in parts:
        name, _, body = part.partition("\n")
        text, _, expected = body.partition(f"{RESULT}\n")
        cases.append(Case(name.strip(), text, expected.rstrip("\n")))
    return head, cases


CASES = [case for golden in GOLDEN for case in read_cases(golden)[1]]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_messages_are_the_reviewed_ones(case: Case) -> None:
    assert case.found() == case.expected


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_was_probably_meant_is_the_fix(case: Case) -> None:
    """But for W221: which of the inputs was meant is not known."""
    for d in case.check(case.program):
        meant = re.search(r"did you mean (\S+)\?$", d.hint or d.message)
        if meant and d.code != "W221":
            assert d.fix is not None, d
            assert d.fix.text == meant[1]


@pytest.mark.parametrize("case", read_cases(GOLDEN[1])[1], ids=lambda case: case.name)
def test_a_fix_mends_what_it_is_for(case: Case) -> None:
    text = case.program
    for _ in range(3):
        fixes = [d.fix for d in case.check(text) if d.fix is not None and d.code.startswith("W1")]
        for fix in sorted(fixes, key=lambda fix: -fix.span.start):
            text = text[: fix.span.start] + fix.text + text[fix.span.end :]
    assert [(d.message, d.fix) for d in case.check(text) if d.fix is not None and d.code.startswith("W1")] == [], text


def test_every_message_about_a_program_has_a_case() -> None:
    everything = "".join(case.expected for case in CASES)
    about_programs = {code for code in FINDINGS if not code.startswith(("W15", "W16", "W25", "W26"))}
    assert {code for code in about_programs if f" {code} «" not in everything} == {"W123", "W136"}  # long programs: test_check.py


def test_there_are_wrong_programs_enough() -> None:
    assert sum(case.expected != NO_FINDING for case in CASES) >= 60
    assert len({case.name for case in CASES}) == len(CASES)


def regenerate() -> None:
    for golden in GOLDEN:
        head, cases = read_cases(golden)
        written = "\n".join(f"{CASE}{case.name}\n{case.text}{RESULT}\n{case.found()}\n" for case in cases)
        golden.write_text(head + written, encoding="utf-8")


if __name__ == "__main__":
    regenerate()
