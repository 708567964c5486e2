"""Positions of a motor record: user coordinates are dial coordinates with DIR and OFF, raw ones are steps of MRES."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from steptwin.gateways.epics.motorfields import FROZEN, first_values
from steptwin.gateways.epics.records import RecordBase


class MotorCoordinates(RecordBase, ABC):
    """The fields of a record, and what follows from those that give positions."""

    def __init__(self) -> None:
        super().__init__()
        self.values = first_values()

    @property
    @abstractmethod
    def is_busy(self) -> bool:
        """Whether a motion is not over yet."""

    def _number(self, name: str) -> float:
        return float(self.values[name])

    @property
    def _sign(self) -> int:
        return -1 if self.values["DIR"] else 1

    def user(self, dial: float) -> float:
        return dial * self._sign + self._number("OFF")

    def _dial(self, user: float) -> float:
        return (user - self._number("OFF")) * self._sign

    def _steps(self, dial: float) -> int:
        """0 where the step is not known."""
        step = self._number("MRES")
        return 0 if math.isnan(step) else max(-(2**31), min(2**31 - 1, round(dial / step)))

    def _aim(self, dial: float) -> None:
        self.values |= {"DVAL": dial, "VAL": self.user(dial), "RVAL": self._steps(dial), "DIFF": dial - self._number("DRBV")}

    def _show_limits(self) -> None:
        """HLM and LLM from those of the dial."""
        ends = sorted((self.user(self._number("DLLM")), self.user(self._number("DHLM"))))
        self.values |= {"LLM": ends[0], "HLM": ends[1]}

    @property
    def _has_limits(self) -> bool:
        return not self._number("DLLM") == self._number("DHLM") == 0.0

    @property
    def _has_no_offset(self) -> bool:
        """Whether positions of the user are those of the dial."""
        return not self.values["OFF"] and self._sign > 0

    def _is_outside(self, dial: float) -> bool:
        return self._has_limits and not self._number("DLLM") <= dial <= self._number("DHLM")

    def shift(self, offset: float) -> None:
        """OFF is put."""
        self.values["OFF"] = offset
        dial = self._number("DRBV")
        self.values["RBV"] = self.user(dial)
        self._aim(self._number("DVAL") if self.is_busy else dial)
        self._show_limits()

    def turn(self, direction: int) -> None:
        """DIR is put: VAL stays, by OFF, unless that is frozen."""
        val = self._number("VAL")
        self.values["DIR"] = direction
        self.shift(self._number("OFF") if self.values["FOFF"] == FROZEN else val - self._number("DVAL") * self._sign)

    def limit(self, name: str, value: float) -> None:
        """One of HLM, LLM, DHLM, DLLM is put."""
        if name in ("HLM", "LLM"):
            is_high = (name == "HLM") is (self._sign > 0)
            name, value = ("DHLM" if is_high else "DLLM"), self._dial(value)
        self.values[name] = value
        self._show_limits()
        self.values["LVIO"] = int(self._is_outside(self._number("DVAL")))
