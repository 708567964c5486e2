"""Plans as plain data: there and back exactly, what is refused, and vectors that a reader in any language must compute alike."""

from __future__ import annotations

import json
from math import cos, pi
from pathlib import Path
from typing import Any

import pytest

from steptwin.motion.divisions import StepTrain, profile_of
from steptwin.motion.planjson import plan_to_json, read_plan

VECTORS: list[dict[str, Any]] = json.loads((Path(__file__).parent / "plan_vectors.json").read_text("utf-8"))["plans"]
NAMES = [one["name"] for one in VECTORS]


def computed(plan: dict[str, Any], time_ns: int) -> tuple[float, float]:
    """Position (pulses) and velocity (pulses/s), as `steptwin.motion.planjson` says, without anything of this package."""
    t = (time_ns - int(plan["start_ns"])) / 1e9
    for segment in plan["segments"]:
        is_arc = isinstance(segment, dict)
        end = segment["end_s"] if is_arc else segment[0]
        if end is not None and t >= end:
            continue
        _, anchor, c0, c1, c2, c3, _ = segment["way"] if is_arc else segment
        u = t - anchor
        way, speed = c0 + c1 * u + c2 * u**2 + c3 * u**3, c1 + 2 * c2 * u + 3 * c3 * u**2
        if not is_arc:
            return plan["base"] + way, speed
        centre, radius, angle, turn = segment["course"]
        # The derivative of the position, by a difference: no formula of the package is used.
        at = [centre + radius * cos((angle + turn * (way + d)) * pi / 2) for d in (-1e-4, 0.0, 1e-4)]
        return plan["base"] + at[1], (at[2] - at[0]) / 2e-4 * speed
    return plan["base"] + plan["final"], 0.0


@pytest.mark.parametrize("vector", VECTORS, ids=NAMES)
def test_positions_follow_from_the_numbers_alone(vector: dict[str, Any]) -> None:
    for time_ns, position, velocity in vector["at"]:
        found = computed(vector["plan"], int(time_ns))
        assert found[0] == pytest.approx(position, abs=1e-6)
        assert found[1] == pytest.approx(velocity, rel=1e-4, abs=1e-2)


@pytest.mark.parametrize("vector", VECTORS, ids=NAMES)
def test_the_plan_read_from_a_vector_is_where_the_vector_says(vector: dict[str, Any]) -> None:
    plan = read_plan(vector["plan"])
    for time_ns, position, velocity in vector["at"]:
        assert profile_of(plan).position(int(time_ns)) == pytest.approx(position, abs=1e-9)
        assert profile_of(plan).velocity(int(time_ns)) == pytest.approx(velocity, abs=1e-6)


@pytest.mark.parametrize("vector", VECTORS, ids=NAMES)
def test_there_and_back_through_json_nothing_changes(vector: dict[str, Any]) -> None:
    plan = read_plan(vector["plan"])
    assert json.loads(json.dumps(plan_to_json(plan))) == vector["plan"]
    assert read_plan(json.loads(json.dumps(plan_to_json(plan)))) == plan


def test_the_vectors_have_every_form_there_is() -> None:
    segments = [segment for one in VECTORS for segment in one["plan"]["segments"]]
    assert any(isinstance(segment, dict) for segment in segments)
    assert any(isinstance(segment, list) and segment[0] is None for segment in segments)
    assert any(isinstance(segment, list) and segment[5] != 0.0 for segment in segments)
    assert any(not one["plan"]["segments"] for one in VECTORS)
    assert any(isinstance(read_plan(one["plan"]), StepTrain) for one in VECTORS)
    assert any(int(one["plan"]["start_ns"]) > 2**53 for one in VECTORS)


@pytest.mark.parametrize(
    "damaged",
    [
        {},
        {"start_ns": 0, "base": 0, "final": 0.0, "segments": []},
        {"start_ns": "-1", "base": 0, "final": 0.0, "segments": []},
        {"start_ns": "9" * 5000, "base": 0, "final": 0.0, "segments": []},
        {"start_ns": "0", "base": 0.5, "final": 0.0, "segments": []},
        {"start_ns": "0", "base": 0, "final": float("nan"), "segments": []},
        {"start_ns": "0", "base": 0, "final": 0.0, "segments": [[1.0]]},
        {"start_ns": "0", "base": 0, "final": 0.0, "segments": [{"end_s": 1.0}]},
        {"start_ns": "0", "base": 0, "final": 0.0, "segments": [], "divisions": [[0]], "microstepping": [1, 8, None]},
    ],
)
def test_what_is_no_plan(damaged: dict[str, Any]) -> None:
    with pytest.raises((TypeError, ValueError, LookupError)):
        read_plan(damaged)
