"""The ``.cfg`` of a MIC488 as a form: `steptwin.configuration`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from steptwin.configuration import ConfigurationKey, Form, Section
from steptwin.datasheet import Limits
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.mic488.config import (
    ADDRESS_KEY,
    AXIS_KEYS,
    UNITS,
    AxisConfig,
    ConfigKey,
    ControllerConfig,
    examine_config,
    input_name,
    keys_of,
    sections_of,
)
from steptwin.mic488.encoding import REAL_MAX, shortest_real
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE
from steptwin.nearmiss import NearMiss
from steptwin.tables import complete


class _Help(NamedTuple):
    meaning: str
    unit: str = ""
    """``u`` is the unit of the axis."""
    source: str = "1.74"


_AXIS = complete(
    "key of an axis",
    [key.name for key in AXIS_KEYS],
    "help",
    {
        "Unit": _Help("Unit of position; velocities and accelerations are in it, too."),
        "Gear": _Help("GEAR: pulses in one unit.", "imp/u", "4.9"),
        "Acc": _Help("Acceleration after power-on.", "u/s²", "4.3"),
        "Dec": _Help("Deceleration after power-on.", "u/s²", "4.3, MIC-29"),
        "Vel": _Help("Velocity of position mode after power-on, VMAX.", "u/s", "4.3"),
        "MotResol": _Help("Pulses in a revolution of the motor.", "imp/rev"),
        "EncResol": _Help("Encoder counts in a revolution of the drive, after ×4.", "counts/rev"),
        "EncOffset": _Help("Encoder counter after reset.", "counts"),
        "HomeMode": _Help(
            "HOME0 stops at the switch, HOME1 backs off, HOME2 goes on past it, HOME3 and HOME4 end at channel C of the encoder.",
            source="4.4",
        ),
        "LimitMode": _Help("Which switches stop the axis."),
        "InKL": _Help("Input of the left switch, for homing and as limit.", source="MIC-30"),
        "InKR": _Help("Input of the right switch, for homing and as limit.", source="MIC-30"),
        "PosCtrlMode": _Help("What the encoder is for: nothing, correction of the position, or the axis follows it."),
        "ErrCtrlMode": _Help("What a position error does: nothing, stop, also stop the program, also set OUT8."),
        "Kp": _Help("Gain of the position correction."),
        "EncTolerance": _Help("Counts by which a position may be missed.", "counts", "MIC-19"),
        "EncSettle": _Help("How long after a move the correction begins.", "ms", "MIC-19"),
        "ErrTime": _Help("How long a drive may be blocked before that is an error.", "ms", "MIC-19"),
        "EnWired": _Help("Whether EN controls the drive.", source="MIC-8"),
    },
)
_OTHERS: Mapping[tuple[str, str], _Help] = {
    ("IN", "Filter"): _Help("How long a level must last to be seen."),
    ("IN", "Level"): _Help("Which level is 1."),
    ("IN", "Int"): _Help("Preset of CFGINT_IN: which edge interrupts the program."),
    ("AIN", "LoVal"): _Help("Value at 0 V."),
    ("AIN", "HiVal"): _Help("Value at 10 V."),
    ("AIN", "Baud"): _Help("Rate of the serial port.", "bit/s", "2"),
    ("AIN", "ID"): _Help("Slave address of both ports.", source="2"),
    ("WBC_PROGRAM", "Activate"): _Help("Whether a program runs at power-on."),
    ("WBC_PROGRAM", "ProgBankToRun"): _Help("Bank of the program that runs at power-on.", source="4.1"),
    ("WBC_PROGRAM", "PosBankToRun"): _Help("Bank of its positions.", source="4.1"),
    ("TRIGGER", "Keep"): _Help("Whether stored values are kept when they are triggered.", source="MIC-16"),
}
_REGISTERS = {"Acc": "ACC", "Dec": "DEC", "Vel": "VMAX"}
"""Keys whose values registers have at run time."""


def config_form(text: str, name: str, firmware: str = DEFAULT_FIRMWARE, gears: Sequence[float | None] = ()) -> Form:
    """Form of the text of a file. ``gears``: pulses in a unit of the running axes, in whose units points are written; None where
    it is not known. Nothing is wrong in an empty text. Raises `Misuse` for an unknown firmware."""
    file = IniFile.of_text(text, name)
    config, findings = examine_config(file, firmware)
    units = _units(file, config, gears)
    sections = tuple(_section(section, file, config, firmware, units) for section in sections_of())
    points = dict(_points(file, config.axes, gears))
    return Form(source=file.source, sections=sections, diagnostics=findings if text.strip() else (), points=points)


def known_settings(
    values: Mapping[str, tuple[float | None, str]], scales: Sequence[tuple[str, float | None]]
) -> Mapping[str, str]:
    """The settings that a running controller shows, by ``Axis0.Acc`` and so on. ``values``: those of its registers, with their
    units; ``scales``: unit and pulses per unit of the axes, None where they are not known."""
    found: dict[str, str] = {}
    for number, (unit, gear) in enumerate(scales):
        section = f"Axis{number}"
        if gear is not None and unit in UNITS:
            found |= {f"{section}.Unit": str(UNITS.index(unit)), f"{section}.Gear": f"{gear:.10g}"}
        for key, register in _REGISTERS.items():
            value, shown = values.get(f"M{number + 1}_{register}", (None, ""))
            if value is not None and (gear is not None or not shown.startswith("imp")):  # with DINT and no GEAR: pulses
                found[f"{section}.{key}"] = shortest_real(value)
    return found


NO_SETTING = Message("mic488.no-setting", "no setting {place!r}{hint}: settings are SECTION.KEY, such as Axis0.Gear")


def with_values(text: str, name: str, changes: Mapping[str, str]) -> str:
    """The text in which ``Axis0.Acc`` and so on have other values; everything else stays as it is. Raises `Misuse` for keys that
    are not there, and for values that a file cannot hold."""
    file = IniFile.of_text(text, name)
    known = {f"{section}.{key.name}": (section, key.name) for section in sections_of() for key in keys_of(section)}
    for place, value in changes.items():
        if place not in known:
            raise Misuse(NO_SETTING(place=place, hint=NearMiss().hint(place, known)))
        file = file.with_value(*known[place], value)
    return file.source.text


def _units(file: IniFile, config: ControllerConfig, gears: Sequence[float | None]) -> list[str]:
    """Units of the axes; ``u`` where neither the file nor the running controller tells."""
    is_unknown = [
        number < len(gears) and gears[number] is None and file.find(f"Axis{number}", "Unit") is None for number in range(AXES)
    ]
    return ["u" if unknown else UNITS[axis.unit] for unknown, axis in zip(is_unknown, config.axes, strict=True)]


def _points(file: IniFile, axes: Iterable[AxisConfig], gears: Sequence[float | None]) -> Iterator[tuple[str, float]]:
    """Values of the keys in the file, by point. Without pulses per unit a file without GEAR is in the units of the axis."""
    for number, (axis, gear) in enumerate(zip(axes, gears, strict=False)):
        section = f"Axis{number}"
        if gear is None and file.find(section, "Gear") is not None:
            continue
        scale = 1.0 if gear is None else axis.gear / gear
        for attribute, key in (("acc", "Acc"), ("dec", "Dec"), ("vel", "Vel")):
            if file.find(section, key) is not None:
                yield f"M{number + 1}_{_REGISTERS[key]}", getattr(axis, attribute) * scale


def _section(section: str, file: IniFile, config: ControllerConfig, firmware: str, units: Sequence[str]) -> Section:
    kind = section.rstrip("0123456789")
    number = int(section.removeprefix(kind) or 0)
    titles = {
        "Axis": f"M{number + 1}",
        "IN": f"IN{number + 1}",
        "AIN": f"AIN{number + 1} · COM{number + 1}",
        "WBC_PROGRAM": "Program",
    }
    unit = units[number] if kind == "Axis" else ""
    keys = [key for key in keys_of(section, firmware) if (section, key.name) != ("AIN1", ADDRESS_KEY.name)]
    held = _held(section, kind, number, config)
    base = _held(section, kind, number, ControllerConfig())
    settings = tuple(_setting(key, section, kind, number, file, held, base, unit) for key in keys)
    return Section(name=section, title=titles.get(kind, "Trigger"), settings=settings)


def _held(section: str, kind: str, number: int, config: ControllerConfig) -> dict[str, float]:
    """Values of a section by attribute."""
    parts: Mapping[str, tuple[object, ...]] = {
        "Axis": config.axes[number : number + 1],
        "IN": config.inputs[number : number + 1],
        "AIN": (*config.analog[number : number + 1], *config.ports[number : number + 1]),
        "WBC_PROGRAM": (config.program,),
        "TRIGGER": (config,),
    }
    found: dict[str, float] = {}
    for key in keys_of(section):
        for part in parts[kind]:
            value = getattr(part, key.attribute, None)
            if value is not None:
                found[key.attribute] = value
    return found


def _setting(
    key: ConfigKey,
    section: str,
    kind: str,
    number: int,
    file: IniFile,
    held: Mapping[str, float],
    base: Mapping[str, float],
    unit: str,
) -> ConfigurationKey:
    row = _AXIS[key.name] if kind == "Axis" else _OTHERS[kind, key.name]
    choices = key.choices or _inputs(key)
    register = _REGISTERS.get(key.name, "") if kind == "Axis" else ""
    return ConfigurationKey(
        name=key.name,
        meaning=row.meaning,
        unit=row.unit.replace("u", unit) if row.unit in ("imp/u", "u/s", "u/s²") else row.unit,
        text=file.get(section, key.name) or "",
        value=held[key.attribute],
        default=base[key.attribute],
        limits=_limits(key),
        is_whole=key.whole,
        choices={value: text or str(value) for value, text in choices.items()},
        point=f"M{number + 1}_{register}" if register else "",
        source=row.source,
    )


def _limits(key: ConfigKey) -> Limits:
    """The permitted range; open where only the range of REAL bounds it."""
    low, high = (None if end is None or abs(end) >= REAL_MAX else end for end in (key.permitted.low, key.permitted.high))
    return Limits(low, high, key.permitted.above)


def _inputs(key: ConfigKey) -> Mapping[int, str]:
    """Names of the inputs that ``InKL`` and ``InKR`` permit."""
    if key.attribute not in ("in_kl", "in_kr") or key.permitted.high is None:
        return {}
    return {number: input_name(number) for number in range(int(key.permitted.high) + 1)}
