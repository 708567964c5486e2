"""The motion calculator for the axes of a subject, as plain values: `steptwin.calc`."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.calc import TIMES, Calculation, Calculator, DriveMechanics, calculator_of
from steptwin.errors import Refusal
from steptwin.messages import Message
from steptwin.studio.controllers import Sheets
from steptwin.studio.toolrequests import MoveQuantities

NO_CALCULATOR = Message(
    "studio.no-calculator",
    "there is no motion calculator for axis {axis} of {controller}: its kind has none, or the pulses in a unit are not known "
    "(config=FILE behind the address of a device)",
)


class Calculations:
    def __init__(self, sheets: Sheets) -> None:
        self._sheets = sheets

    def quantities(self, controller: str, axis: int) -> MoveQuantities:
        """Quantities of a move of an axis. Raises `Misuse` for another controller, `Refusal` where there is no calculator."""
        calculator = self._calculator(controller, axis)
        return MoveQuantities(calculator.model.title, calculator.model.quantities, TIMES)

    def calculate(self, controller: str, axis: int, given: Mapping[str, float], find: str | None) -> Calculation:
        """See `steptwin.calc.Calculator.calculate`."""
        return self._calculator(controller, axis).calculate(given, find)

    def _calculator(self, controller: str, axis: int) -> Calculator:
        found = calculator_of(self._sheets.of(controller), axis)
        if found is None:
            raise Refusal(NO_CALCULATOR(axis=axis, controller=controller))
        return found


def gear(motor_steps: float, microsteps: float, ratio: float, lead: float | None) -> Mapping[str, float]:
    """Pulses in each unit. Raises `Misuse`."""
    return dict(DriveMechanics(motor_steps=motor_steps, microsteps=microsteps, ratio=ratio, lead=lead).scale().pulses)
