"""WBC programs for another firmware. Sizes and features are those of the manuals."""

from __future__ import annotations

import pytest

from steptwin.wbc.dialect import DIALECTS
from steptwin.wbc.migration import differences, findings

FEATURES = (
    "PULSE, HARDINT_ labels, ticks of 100 and 1000 ms and interrupts of drives",
    "STATUS, which reads 0 before",
    "a position error with ERRMODE1 that pauses the program, instead of stopping it",
)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("1.23", "1.23", []),
        ("1.23", "1.40", ["2000 user registers, not 500"]),
        ("1.40", "1.23", ["500 user registers, not 2000"]),
        ("1.40", "1.70", ["4000 executable lines, not 1000", *(f"with {feature}" for feature in FEATURES)]),
        ("1.70", "1.40", ["1000 executable lines, not 4000", *(f"without {feature}" for feature in FEATURES)]),
        (
            "1.70",
            "1.23",
            ["500 user registers, not 2000", "1000 executable lines, not 4000", *(f"without {feature}" for feature in FEATURES)],
        ),
    ],
)
def test_what_a_program_may_notice(old: str, new: str, expected: list[str]) -> None:
    assert list(differences(DIALECTS[old], DIALECTS[new])) == expected


def test_only_what_the_new_firmware_does_not_take_is_found() -> None:
    text = "PULSE(OUT1, 0.5)\nfoo bar\nHARDINT_IN1:\nRETURN\n"
    found = findings(text, DIALECTS["1.70"], DIALECTS["1.40"])
    assert [d.message for d in found] == ["PULSE needs firmware 1.70", "the label HARDINT_IN1 needs firmware 1.70"]
    assert findings(text, DIALECTS["1.40"], DIALECTS["1.70"]) == []
