"""Programs for another type: sizes are those of chapters II and X, conversions those of a clock twice as fast."""

from __future__ import annotations

import pytest

from steptwin.m1486.migration import differences, findings
from steptwin.m1486.variants import variant

SHARED = "registers 1 to 8 share the command memory"
BUFFER = "input buffer of 32 characters, not 12"
OWN = "registers have a memory of their own"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("A", "A", []),
        ("A", "B", ["labels 1 to 80, not to 15", "command memory of 2032 bits, not 864", BUFFER, OWN]),
        ("C", "A", ["command memory of 864 bits, not 4000", "no PWM outputs"]),
        ("A", "C", ["command memory of 4000 bits, not 864"]),
        (
            "B",
            "E1",
            [
                "command memory of 2000 bits, not 2032",
                "the file in [ ] is kept and runs at power-up; each command takes 0.5 s to receive",
                "addresses 1 to F, not 0 to F",
                "no shutdown by the pin SD",
            ],
        ),
        (
            "E2",
            "C",
            [
                "labels 1 to 15, not to 80",
                "input buffer of 12 characters, not 32",
                SHARED,
                "the program is lost with the power, and a host must send it",
                "addresses 0 to F, not 1 to F",
            ],
        ),
        ("E1", "E2", ["command memory of 4000 bits, not 2000"]),
        ("A", "A2x", ["everything twice as fast, the serial line too: W, S, V, P and A are converted, defaults are not"]),
        ("A2x", "A", ["everything half as fast, the serial line too: W, S, V, P and A are converted, defaults are not"]),
    ],
)
def test_what_a_program_may_notice(old: str, new: str, expected: list[str]) -> None:
    assert list(differences(variant(old), variant(new))) == expected


def found(text: str, old: str, new: str) -> list[tuple[str, str | None, str | None]]:
    """Message, hint and the text of the fix of each finding, which is where its text stands."""
    result = []
    for finding in findings(text, variant(old), variant(new)):
        if finding.fix is not None:
            assert finding.fix.span == finding.span
        result.append((finding.message, finding.hint, None if finding.fix is None else finding.fix.text))
    return result


def test_numbers_for_the_other_clock() -> None:
    """Twice as many milliseconds, half the speed, a quarter of the acceleration; distances stay."""
    assert found("w1000\nv300\na7000\ns100\np25000\nf64\n", "B", "B2x") == [
        ("W1000 is W2000 on M1486B2x", None, "2000"),
        ("V300 is V150 on M1486B2x", None, "150"),
        ("A7000 is A1750 on M1486B2x", None, "1750"),
        ("S100 is S50 on M1486B2x", None, "50"),
    ]  # P25000 is no parabolic acceleration, at any clock
    assert found("w3\nv301\na7001\n", "B2x", "B") == [
        ("W3 is W1.5 on M1486B", "rounded to a whole number", "2"),
        ("V301 is V602 on M1486B", None, "602"),
        ("A7001 is A28004 on M1486B", None, "28004"),
    ]


def test_numbers_that_have_none() -> None:
    assert found("v20\n", "B", "B2x") == [
        ("V20 would have to be V10 on M1486B2x: permitted is 16 to 20 000 step/s", None, None),
    ]
    assert found("t40\nw\nv\n", "B", "B2x") == [
        ("the internal variable means another time here", "its values must be converted", None),
        ("the internal variable means another speed or acceleration here", "its values must be converted", None),
    ]


def test_only_what_the_new_type_does_not_take_is_found() -> None:
    assert found("v5\nw1000\n", "B", "A") == []  # wrong for both
    hint = "1 to 15 on M1486A; M1486B, M1486E1, M1486E2 would take it"
    assert found("t40\nj20\n@20\n", "B", "A") == [("label 20 is out of range", hint, "1")] * 2


def test_findings_of_both_sorts_are_in_the_order_of_the_text() -> None:
    places = [finding.span.start for finding in findings("w10\nt40\nj20\n@20\nv300\n", variant("B"), variant("A2x"))]
    assert places == sorted(places)
    assert len(places) == 4


def test_free_labels_reach_up_to_the_last() -> None:
    """Labels 1 to 14 are used: 15 is the one that is free."""
    text = "".join(f"@{label}\nw10\n" for label in range(1, 15)) + "@20\nt40\nj20\n"
    assert [fix for _, _, fix in found(text, "B", "A") if fix] == ["15", "15"]
    assert [fix for _, _, fix in found("@15\n" + text, "B", "A") if fix] == []
