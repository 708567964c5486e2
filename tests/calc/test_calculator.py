"""What every kind of controller shares: the choice by data sheet, the curve, the JSON."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from steptwin.calc import Calculator, Mic488Model, calculator_of
from steptwin.errors import Misuse
from steptwin.jsonvalues import to_json
from steptwin.m1486.datasheet import datasheet_of as chip_sheet
from steptwin.m1486.variants import variant
from steptwin.mic488.datasheet import datasheet_of

RESULT = Calculator(Mic488Model("mm", 640)).calculate({"distance": 150, "velocity": 60, "acceleration": 300})


def test_the_curve_ends_where_the_move_does() -> None:
    points = RESULT.curve
    assert points[0] == (0, 0, 0)
    assert points[-1] == pytest.approx((2.7, 150, 0))
    assert max(point.velocity for point in points) == pytest.approx(60)
    assert [one.time_s for one in points] == sorted(one.time_s for one in points)


def test_as_json() -> None:
    data = json.loads(json.dumps(to_json(RESULT)))
    assert data["times"]["time"] == pytest.approx(2.7)
    assert data["parts"][0]["name"] == "acceleration"
    assert data["settings"][0] == {"name": "velocity", "code": "M1_VMAX", "detail": "", "value": 60, "unit": "mm/s"}
    assert data["curve"][-1][1] == pytest.approx(150)


def test_by_data_sheet() -> None:
    sheet = datasheet_of("1.70", (("imp", 1.0), ("mm", 640.0), ("imp", 1.0), ("rev", None)))
    second = calculator_of(sheet, 2)
    assert second is not None
    assert (second.quantities["velocity"].unit, second.quantities["velocity"].code) == ("mm/s", "M2_VMAX")
    assert calculator_of(sheet, 4) is None
    chip = calculator_of(chip_sheet(variant("B2x")), 1)
    assert chip is not None
    assert chip.model.title == "M1486B2x"
    assert calculator_of(sheet, 5) is None
    assert calculator_of(replace(sheet, kind="toy"), 1) is None


def test_a_missing_axis() -> None:
    with pytest.raises(Misuse, match="axis 5: a MIC488 has 1 to 4"):
        Mic488Model(axis=5)
