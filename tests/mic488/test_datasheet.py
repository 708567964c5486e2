"""Data sheet of the MIC488, every field, reviewed once against tables 3.1 and 3.2 and chapter 4 of the manuals:
golden/datasheet.txt. Of the axes the first; what differs is the number.

Regenerate with ``PYTHONPATH=tests/support python tests/mic488/test_datasheet.py`` and read the diff.
"""

from __future__ import annotations

import re
from pathlib import Path

from sheets import missing, sheet_lines

from steptwin.datasheet import Condition, EventSeverity
from steptwin.mic488.config import UNITS, AxisConfig, ControllerConfig
from steptwin.mic488.datasheet import datasheet, datasheet_of
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registers import AXES, FIRMWARES
from steptwin.mic488.status import AxisStatus

GOLDEN = Path(__file__).parent / "golden" / "datasheet.txt"
LATEST, *OLDER = reversed(tuple(FIRMWARES))
OTHER_AXES = re.compile(r'"(path|name|code)": "M[234][_.]')


def lines(firmware: str) -> list[str]:
    return [line for line in sheet_lines(datasheet_of(firmware)) if not OTHER_AXES.search(line)]


def everything() -> dict[str, list[str]]:
    latest, sheet = lines(LATEST), datasheet_of(LATEST)
    return {
        f"data sheet of {LATEST}": latest,
        **{f"other lines of {name}": [line for line in lines(name) if line not in latest] for name in OLDER},
        **{f"not in {name}": missing(sheet, datasheet_of(name)) for name in OLDER},
    }


def test_data_sheets_are_the_reviewed_ones() -> None:
    texts = GOLDEN.read_text(encoding="utf-8").split("=== ")[1:]
    expected = {name: rows for name, *rows in (text.rstrip().splitlines() for text in texts)}
    found = everything()
    assert found.keys() == expected.keys()
    for name, rows in found.items():
        assert rows == expected[name]


def test_axes_have_the_same_points_and_commands() -> None:
    sheet = datasheet_of(LATEST)
    for names in ([point.path for point in sheet.points], [command.name for command in sheet.commands]):
        of_axes = [{name[2:] for name in names if re.match(rf"M{axis}[_.]", name)} for axis in range(1, AXES + 1)]
        assert of_axes == [of_axes[0]] * AXES
        assert of_axes[0]


def test_units_are_those_of_the_configuration() -> None:
    axes = (
        AxisConfig(),
        AxisConfig(unit=UNITS.index("mm"), gear=100.0),
        AxisConfig(),
        AxisConfig(unit=UNITS.index("degree"), gear=8.5),
    )
    sheet = datasheet(Mic488Device(ControllerConfig(axes=axes)))
    assert [(axis.name, axis.unit, axis.pulses_per_unit) for axis in sheet.axes] == [
        ("M1", "imp", 1.0), ("M2", "mm", 100.0), ("M3", "imp", 1.0), ("M4", "degree", 8.5)
    ]  # fmt: skip
    for path, unit in (("M2.position", "mm"), ("M4.velocity", "degree/s"), ("M1.position", "imp"), ("M4_POS_ACT", "degree")):
        assert sheet.point(path).unit == unit


def test_each_value_of_a_status_has_its_condition() -> None:
    sheet = datasheet_of(LATEST)
    for path in ("status", "M1.status"):
        point = sheet.point(path)
        assert set(point.conditions) == set(point.values)
    conditions = sheet.point("M1.status").conditions
    assert {
        value.name: conditions[value] for value in (AxisStatus.OFF, AxisStatus.HOMING, AxisStatus.ERROR, AxisStatus.LIMIT_L)
    } == {
        "OFF": Condition.OFF,
        "HOMING": Condition.MOVING,
        "ERROR": Condition.ERROR,
        "LIMIT_L": Condition.WARNING,
    }


def test_events_say_how_grave_they_are() -> None:
    events = {event.code: event for event in datasheet_of(LATEST).events}
    assert (events["homed"].severity, events["homed"].stops_motor) == (EventSeverity.INFORMATION, None)
    assert (events["limit"].severity, events["limit"].stops_motor) == (EventSeverity.WARNING, True)
    assert (events["position-error"].severity, events["overrun"].stops_motor) == (EventSeverity.ALARM, False)


if __name__ == "__main__":
    GOLDEN.write_text("\n".join("\n".join([f"=== {name}", *rows]) for name, rows in everything().items()) + "\n", "utf-8")
