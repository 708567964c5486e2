"""The context of a program: the other files of its controller."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.mic488.config import ControllerConfig
from steptwin.wbc.dialect import DEFAULT, Dialect
from steptwin.wbc.positions import PositionTable


@dataclass(frozen=True, slots=True)
class ProgramContext:
    """Position table and configuration, None if the controller has none, and the firmware."""

    positions: PositionTable | None = None
    config: ControllerConfig | None = None
    dialect: Dialect = DEFAULT
