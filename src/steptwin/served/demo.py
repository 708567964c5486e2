"""The machine behind ``--demo``: four spindles with a switch at each end, so that homing and limits work from the first day."""

from __future__ import annotations

from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.world.contacts import PositionSwitch, place
from steptwin.world.kernel import Kernel, PinName

GEAR = 100.0
"""Pulses per mm."""
KL_MM, KR_MM = -10, 250
"""Where the switches are, seen from the position at power-on."""


def demo_config() -> ControllerConfig:
    """Millimetres; KL on IN1–IN4, KR on IN5–IN8; homing backs off the switch (HOME1)."""
    return ControllerConfig(
        axes=tuple(
            AxisConfig(unit=3, gear=GEAR, acc=50.0, dec=50.0, vel=25.0, home_mode=1, limit_mode=3, in_kl=axis, in_kr=axis + 4)
            for axis in range(4)
        )
    )


def place_switches(kernel: Kernel, machine: str) -> None:
    for axis in range(1, 5):
        place(kernel, PositionSwitch(machine, axis, None, int(KL_MM * GEAR), PinName(machine, f"IN{axis}")))
        place(kernel, PositionSwitch(machine, axis, int(KR_MM * GEAR), None, PinName(machine, f"IN{axis + 4}")))
