"""Generated worlds of MIC488 controllers on one line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from steptwin.simulation.describe.generated import LINE, InputChange, TomlTable, Whole, generated_world

AXES = "xyzu"
"""Names of the spindles of `demo`."""
GEAR = 100.0
"""Pulses per mm of `demo`."""
KL_MM, KR_MM = -10.0, 250.0
"""Where the switches of `demo` are, seen from the position at power-on."""
_EXAMPLE = """
# An axis with a home switch:
#
# [[axis]]
# name = "x"
# drive = "{controller}.M1"
# unit = "mm"
# pitch = 5.0
#
# [[axis.switch]]
# below = 0.0
# to = "{controller}.IN1"
"""


class AxisSwitches(NamedTuple):
    """Where switches of an axis are (number from 1), seen from the place at power-on in configured units; None: there is none."""

    axis: int
    low: float | None
    high: float | None
    low_pin: str
    high_pin: str
    contacts: tuple[str, str] = ("NO", "NO")


def mic488_world(
    whole: Whole,
    units: Sequence[int | None],
    values: Mapping[str, object],
    *,
    demo: bool = False,
    switches: Iterable[AxisSwitches] = (),
    changes: Iterable[InputChange] = (),
) -> str:
    """MIC488 controllers by their units (None: that of the configuration), all with the same ``values`` of ``[[mic488]]``.

    ``demo``: each moves four spindles in mm with a switch at each end, so that homing and limits work from the first day.
    ``switches`` are those of axes of the first controller.
    """
    names = ["mic488" if len(units) == 1 else f"mic488-{unit}" for unit in units]
    tables: list[TomlTable] = []
    for name, unit in zip(names, units, strict=True):
        tables.append(TomlTable("mic488", {"name": name, "line": LINE, "unit": unit, **values}))
        tables += _demo_axes() if demo else ()
    if demo:
        for name, unit in zip(names, units, strict=True):
            tables += _spindles(name, "" if len(names) == 1 else f"-{unit}")
    axes = [table for one in switches for table in _switches(names[0], one)]
    example = "" if demo or axes else _EXAMPLE.format(controller=names[0])
    return generated_world(whole, "modbus", [*tables, *axes], changes, example)


def _demo_axes() -> Iterator[TomlTable]:
    """Millimetres; KL on IN1–IN4, KR on IN5–IN8; homing backs off the switch (HOME1)."""
    for n in range(1, len(AXES) + 1):
        values = {"unit": "mm", "gear": GEAR, "acc": 50.0, "dec": 50.0, "vel": 25.0, "home_mode": "HOME1"}
        switches = {"limit_mode": "KL+KR", "in_kl": f"IN{n}", "in_kr": f"IN{n + 4}"}
        yield TomlTable("", {**values, **switches}, header=f"[mic488.M{n}]")


def _spindles(controller: str, suffix: str) -> Iterator[TomlTable]:
    for n, name in enumerate(AXES, start=1):
        remark = "Spindles with a switch at each end; travel, play, motors and encoders may follow." if n == 1 else ""
        yield TomlTable("axis", {"name": f"{name}{suffix}", "drive": f"{controller}.M{n}"}, remark=remark)
        yield TomlTable("switch", {"below": KL_MM, "to": f"{controller}.IN{n}"})
        yield TomlTable("switch", {"above": KR_MM, "to": f"{controller}.IN{n + 4}"})


def _switches(controller: str, axis: AxisSwitches) -> Iterator[TomlTable]:
    """The axis with its switches."""
    yield TomlTable("axis", {"name": f"m{axis.axis}", "drive": f"{controller}.M{axis.axis}"})
    for key, edge, pin, contact in (
        ("below", axis.low, axis.low_pin, axis.contacts[0]),
        ("above", axis.high, axis.high_pin, axis.contacts[1]),
    ):
        if edge is not None:
            yield TomlTable("switch", {key: edge, "to": f"{controller}.{pin}", "contact": None if contact == "NO" else contact})
