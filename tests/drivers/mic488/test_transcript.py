"""Transcripts: what each line does, and where two of them differ. The twin lives in virtual time."""

from __future__ import annotations

import dataclasses

import pytest
from host_rig import Wire, driver

from steptwin.drivers.mic488 import transcript
from steptwin.drivers.mic488.transcript import (
    TranscriptDifference,
    TranscriptStep,
    carry_out,
    carry_out_one,
    differences,
    from_text,
    steps_of,
    to_text,
)
from steptwin.errors import Misuse, Refusal
from steptwin.mic488.registers import register_map

STEPS = """
set M1_EN=on           # the drive
set M1_POS_ABS=8
wait M1
get M1_POS_ACT M1_STATUS
raw 03 27 24 00 02
sleep 0
"""


def recorded(wire: Wire) -> list[TranscriptStep]:
    return list(carry_out(driver(wire), steps_of(STEPS, register_map())))


def test_a_transcript() -> None:
    steps = recorded(Wire())
    assert [step.line for step in steps][:2] == ["set M1_EN=on", "set M1_POS_ABS=8"]
    assert [step.result for step in steps] == [
        {},
        {},
        {"M1": {"reason": "target reached", "position": 8.0}},
        {"M1_POS_ACT": 8.0, "M1_STATUS": 4},
        {"answer": "03 04 00 00 41 00"},
        {},
    ]
    assert from_text("\n".join(to_text(steps, {"device": "twin"})), "x") == [
        dataclasses.replace(step, at_s=round(step.at_s, 4)) for step in steps
    ]


def test_a_refusal_is_a_result() -> None:
    result = carry_out_one(driver(Wire()), "raw 03 75 30 00 02")
    assert "exception 02" in result["refused"]


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("jump", "expected get NAME"),
        ("get", "'get': the name of a register"),
        ("get M1_STOP", "M1_STOP can only be written"),
        ("set M1_ACC", "expected set NAME=VALUE"),
        ("set M1_ACC=x", "'set M1_ACC=x': 'x' is not a number"),
        ("set M1_ACC=-5", "M1_ACC = -5 u/s²: permitted > 0"),
        ("set M1_POS_ABS=nan", "'nan' is not a number"),
        ("set M1_STATUS=1", "M1_STATUS can only be read"),
        ("sleep", "expected seconds"),
        ("sleep -1", "expected seconds from 0 to 3600"),
        ("sleep 3601", "expected seconds from 0 to 3600"),
        ("wait X", "expected axes"),
        ("wait 7", "expected axes, 1 to 4"),
        ("raw 0", "hexadecimal"),
        ("raw 63 00", "raw 63 00"),
        ("get M1_X", "no register named 'M1_X'"),
    ],
)
def test_what_is_no_step(line: str, text: str) -> None:
    with pytest.raises(Misuse, match=text):
        carry_out_one(driver(Wire()), line)


def test_all_lines_are_read_before_the_first_is_sent() -> None:
    for line in ("fly M1", "set M1_ACC=x", "set M1_ACC=0", "get M1_NONE", "raw 99"):
        with pytest.raises(Misuse, match=f"line 2: '{line}': "):
            steps_of(f"get M1_ACC\n{line}\n", register_map())
    with pytest.raises(Misuse, match="unknown step: expected get NAME"):
        steps_of("# nothing\n", register_map())


def test_a_step_that_those_before_it_make_senseless() -> None:
    steps = carry_out(driver(Wire()), steps_of("set M1_EN=1\nset M1_VEL_ABS=5\nwait 1", register_map()))
    with pytest.raises(Refusal, match="'wait 1': M1 runs in velocity mode and does not end by itself"):
        list(steps)


def test_two_transcripts() -> None:
    one, wire = recorded(Wire()), Wire()
    wire.twin.axes[0].set_coordinate(900, wire.now)
    assert differences(one, recorded(wire)) == []
    slow = [dataclasses.replace(step, at_s=step.at_s + 2.0 * (n == 4)) for n, step in enumerate(one)]
    assert differences(one, slow) == []
    (found,) = differences(one, slow, time_s=1.0)
    assert (found.step, found.line, found.what) == (5, one[4].line, "time in s")
    assert (found.one, found.two) == (one[4].at_s, slow[4].at_s)
    other = list(one)
    other[2] = TranscriptStep("wait M1", 0.0, {"M1": {"reason": "stopped at limit R", "position": 7.99}})
    other[3] = TranscriptStep(one[3].line, 0.0, {"M1_STATUS": 4})
    assert [str(d) for d in differences(one, other)] == [
        'step 3, wait M1: M1 reason: "target reached" | "stopped at limit R"',
        "step 3, wait M1: M1 position: 8.0 | 7.99",
        "step 4, get M1_POS_ACT M1_STATUS: M1_POS_ACT: 8.0 | nothing",
    ]
    assert len(differences(one, other, tolerance=0.011)) == 2
    with pytest.raises(Misuse, match="the transcripts have different requests"):
        differences(one, one[1:])


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        '{"format": "steptwin session 2"}',
        "[" * 100_000,
        '{"format": "steptwin session 1"}\n{}',
        "x",
        '{"format": "steptwin session 1"}\nx',
    ],
)
def test_what_is_no_transcript(text: str) -> None:
    with pytest.raises(Misuse, match=r"a.json is not a transcript"):
        from_text(text, "a.json")


def test_a_motion_that_did_not_arrive_is_a_result() -> None:
    """The switch KR is at 250 mm."""
    mic = driver(Wire())
    mic.set("M1_EN", 1)
    mic.set("M1_POS_ABS", 400.0)
    result = carry_out_one(mic, "wait M1")
    assert result["M1"]["reason"] == "stopped at limit R"
    assert result["M1"]["position"] == pytest.approx(250.0, abs=10.0)


def test_differences_are_shown_as_they_are_written() -> None:
    assert str(TranscriptDifference(2, "get X", "X", "5 °C", None)) == 'step 2, get X: X: "5 °C" | nothing'


@pytest.mark.parametrize("seconds", ["0", "3600", "0.25"])
def test_a_sleep(seconds: str, monkeypatch: pytest.MonkeyPatch) -> None:
    slept: list[float] = []
    mic = driver(Wire())
    with monkeypatch.context() as patched:
        patched.setattr(transcript.time, "sleep", slept.append)
        assert carry_out_one(mic, f"sleep {seconds}") == {}
    assert slept == [float(seconds)]


@pytest.mark.parametrize("line", ["sleep 3600.1", "sleep -0.1", "sleep nan", "sleep 1 2", "sleep x", "sleep"])
def test_what_is_no_sleep(line: str) -> None:
    with pytest.raises(Misuse, match=f"^{line!r}: expected seconds from 0 to 3600$"):
        carry_out_one(driver(Wire()), line)


def test_times_count_from_the_first_line(monkeypatch: pytest.MonkeyPatch) -> None:
    mic, clock = driver(Wire()), iter([100.0, 100.25, 107.5])
    steps = steps_of("get M1_STATUS\nget M2_STATUS", register_map())
    with monkeypatch.context() as patched:
        patched.setattr(transcript.time, "monotonic", lambda: next(clock))
        assert [step.at_s for step in carry_out(mic, steps)] == [0.25, 7.5]
    (_, line) = to_text([TranscriptStep("get X", 1.23456789, {"X": "5 °C"})], {"device": "a"})
    assert line == '{"line": "get X", "at_s": 1.2346, "result": {"X": "5 °C"}}'


@pytest.mark.parametrize(
    ("one", "two", "tolerance", "alike"),
    [
        (1.0, 1.5, 0.5, True),
        (1.0, 1.5, 0.49, False),
        (1.5, 1, 0.5, True),
        (True, 1, 0.0, True),
        (True, 0, 1.0, False),
        ("a", "a", 0.0, True),
        ("a", "b", 9.0, False),
        (1.0, None, 9.0, False),
        (None, 1.0, 9.0, False),
    ],
)
def test_values_that_are_alike(one: object, two: object, tolerance: float, alike: bool) -> None:
    found = differences(
        [TranscriptStep("get X", 0.0, {"X": one})], [TranscriptStep("get X", 0.0, {"X": two})], tolerance=tolerance
    )
    assert (found == []) is alike


@pytest.mark.parametrize(("time_s", "differ"), [(None, False), (0.5, False), (0.49, True)])
def test_times_that_are_alike(time_s: float | None, differ: bool) -> None:
    for at_s in (1.5, 0.5):
        found = differences([TranscriptStep("wait", 1.0)], [TranscriptStep("wait", at_s)], time_s=time_s)
        assert bool(found) is differ


def test_every_refusal_is_a_result_in_its_words() -> None:
    def refuse(mic: object) -> dict[str, object]:
        raise Refusal("not now")

    ((step),) = carry_out(driver(Wire()), [("set M1_EN=1", refuse)])
    assert step.result == {"refused": "not now"}
