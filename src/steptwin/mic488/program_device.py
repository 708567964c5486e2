"""The controller on which a program runs, as its program needs it: axes, inputs, outputs, user registers."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import Protocol

from steptwin.controller import Nanos
from steptwin.mic488.axis import Axis
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.inputs import Inputs
from steptwin.mic488.registermap import Firmware
from steptwin.mic488.status import ControllerStatus


class ProgramDevice(Protocol):
    """The controller, as far as programs reach. Numbers of inputs and outputs count from 0."""

    @property
    def config(self) -> ControllerConfig: ...
    @property
    def firmware(self) -> Firmware: ...
    @property
    def axes(self) -> tuple[Axis, ...]: ...
    @property
    def inputs(self) -> Inputs: ...
    @property
    def outputs(self) -> Sequence[bool]: ...
    @property
    def user(self) -> array[int]:
        """User registers: one word each."""
        ...

    def set_output(self, number: int, on: bool, now: Nanos) -> None: ...
    def analog(self, number: int) -> float:
        """Analog input, scaled as configured."""
        ...

    def status(self) -> ControllerStatus: ...
    def event(self, code: str, detail: str, now: Nanos) -> None: ...
