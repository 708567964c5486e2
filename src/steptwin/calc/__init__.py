"""The motion calculator: any quantity of a move from the others, with the plans of the controllers themselves. Pure.

>>> from steptwin.calc import Calculator, Mic488Model
>>> result = Calculator(Mic488Model("mm", gear=640)).calculate({"distance": 150, "velocity": 60, "acceleration": 300})
>>> round(result.times["time"], 6)
2.7
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from steptwin.calc.calculator import TIMES, Calculator, range_text
from steptwin.calc.contract import (
    Calculation,
    CurvePoint,
    Formula,
    Model,
    MovePhase,
    MoveQuantity,
    RequiredSetting,
)
from steptwin.calc.m1486 import M1486Model
from steptwin.calc.mic488 import Mic488Model
from steptwin.calc.units import Dimension, DriveMechanics, UnitScale, read_lead, read_quantity, unit_of
from steptwin.datasheet import AxisDescription, Datasheet
from steptwin.m1486.variants import variant

__all__ = [
    "TIMES",
    "Calculation",
    "Calculator",
    "CurvePoint",
    "Dimension",
    "DriveMechanics",
    "Formula",
    "M1486Model",
    "Mic488Model",
    "Model",
    "MovePhase",
    "MoveQuantity",
    "RequiredSetting",
    "UnitScale",
    "calculator_of",
    "range_text",
    "read_lead",
    "read_quantity",
    "unit_of",
]


def _mic488(sheet: Datasheet, axis: AxisDescription) -> Model | None:
    if axis.pulses_per_unit is None:  # of a device without its configuration: neither pulses nor the highest velocity are known
        return None
    return Mic488Model(axis.unit, axis.pulses_per_unit, axis.number)


def _m1486(sheet: Datasheet, axis: AxisDescription) -> Model | None:
    return M1486Model(variant(sheet.variant))


_MODELS: Mapping[str, Callable[[Datasheet, AxisDescription], Model | None]] = {"mic488": _mic488, "m1486": _m1486}
"""By kind of controller; other kinds have no calculator."""


def calculator_of(sheet: Datasheet, axis: int) -> Calculator | None:
    """For an axis of a controller, in the units of its data sheet; None where there is none, or its pulses are not known."""
    make = _MODELS.get(sheet.kind)
    found = next((one for one in sheet.axes if one.number == axis), None)
    model = None if make is None or found is None else make(sheet, found)
    return None if model is None else Calculator(model)
