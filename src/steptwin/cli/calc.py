"""``steptwin calc``: any quantity of a move from the others.

From Python: `steptwin.calc.Calculator`.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli.device import Json, table
from steptwin.cli.optiongroups import grouped
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse
from steptwin.options import Option, OptionGroup, option_of

if TYPE_CHECKING:
    from steptwin.calc import Calculation, Calculator, UnitScale


class CalculatedKind(enum.StrEnum):
    MIC488 = "mic488"
    M1486 = "m1486"


def _value(meaning: str) -> Option:
    return Option(meaning, metavar="VALUE")


@dataclass(frozen=True, kw_only=True)
class QuantityOptions(OptionGroup):
    heading = "Quantities of the move"

    distance: Annotated[str | None, _value("Distance: 150mm, 2.5rev, 96000.")] = None
    velocity: Annotated[str | None, _value("Velocity (VMAX, V): 60mm/s, 600rpm.")] = None
    acceleration: Annotated[str | None, _value("Acceleration (ACC, A): 300mm/s2.")] = None
    deceleration: Annotated[str | None, _value("Deceleration (DEC) of a MIC488. Default: the acceleration.")] = None
    start_stop: Annotated[str | None, _value("Start/stop velocity (S) of an M1486.")] = None
    profile: Annotated[str | None, _value("Profile point (P) of an M1486. Default: none.")] = None
    time: Annotated[str | None, _value("Total time: 2s, 250ms.")] = None
    acceleration_time: Annotated[str | None, _value("Time of acceleration.")] = None
    constant_time: Annotated[str | None, _value("Time at constant velocity.")] = None
    deceleration_time: Annotated[str | None, _value("Time of deceleration.")] = None
    microstep: Annotated[int | None, Option("M of an M1486. Default: 4.", flags=("--microstep", "-M"))] = None
    qualification: Annotated[int | None, Option("Q of an M1486. Default: 1.", flags=("--qualification", "-Q"))] = None


@dataclass(frozen=True, kw_only=True)
class MechanicsOptions(OptionGroup):
    heading = "Mechanics"

    motor_steps: Annotated[float | None, Option("Full steps in a revolution of the motor. Default: 200.")] = None
    microsteps: Annotated[float | None, Option("Pulses in a full step of a MIC488, as its drive is set.")] = None
    ratio: Annotated[float | None, Option("Revolutions of the motor for one revolution of its load. Default: 1.")] = None
    lead: Annotated[
        str | None,
        _value("Travel in one revolution: lead of a screw, teeth × pitch of a pulley, such as 5mm [mm]."),
    ] = None

    def values(self) -> dict[str, float]:
        """Given values; the lead in mm. Raises `Misuse`."""
        from steptwin.calc import read_lead

        found = self.given()
        if self.lead is not None:
            try:
                found["lead"] = read_lead(self.lead)
            except Misuse as error:
                raise Misuse(f"--lead: {error}") from None
        return found


@dataclass(frozen=True, kw_only=True)
class Mic488MoveOptions(OptionGroup):
    heading = "Options of the MIC488"

    unit: Annotated[
        str | None,
        Option(
            metavar="UNIT",
            help="imp, rev, degree, mm, cm or m. Default: mm with --lead, rev with --microsteps, else imp.",
        ),
    ] = None
    gear: Annotated[float | None, Option("GEAR, pulses in a unit, instead of the mechanics.")] = None
    axis: Annotated[int | None, Option("Axis, for the names of registers. Default: 1.")] = None


@dataclass(frozen=True, kw_only=True)
class M1486MoveOptions(OptionGroup):
    heading = "Options of the M1486"

    variant: Annotated[str | None, Option(metavar="TYPE", help="Type. Default: A.", completion="variants")] = None


@grouped
def command(
    kind: Annotated[CalculatedKind, typer.Argument(metavar="KIND", help="mic488 or m1486.")],
    find: Annotated[
        str | None,
        typer.Option(metavar="QUANTITY", help="The quantity that a time determines. Default: the one that is not given."),
    ] = None,
    output: Annotated[Path | None, written("--output", "-o", help="A picture of the profile: FILE.svg or FILE.png.")] = None,
    json: Json = False,
    *,
    quantities: QuantityOptions,
    mechanics: MechanicsOptions,
    controller: Mic488MoveOptions,
    chip: M1486MoveOptions,
) -> None:
    """Calculate a move: its times, or with a time the quantity that is not given; and GEAR from the mechanics.

    Values have units: of distance imp, step, rev, degree, mm, cm, m, with /s or /s2 behind them, of time s, ms, min; a number
    without a unit is in the controller's own unit. Exit code 2 if a value is outside its range or a time is not possible.
    """
    known_mechanics = mechanics.values()
    if kind is CalculatedKind.MIC488:
        chip.refuse("the MIC488")
        calculator, scale = _mic488(known_mechanics, controller)
    else:
        controller.refuse("the M1486")
        calculator, scale = _m1486(known_mechanics, chip)
    values = _values(calculator, scale, quantities.given())
    if not values and known_mechanics and find is None and output is None:
        _print_scale(scale, json=json)
        return
    result = calculator.calculate(values, None if find is None else find.replace("-", "_"))
    if output is not None:
        from steptwin.files.export import write_profile

        write_profile(result, output)
    if json:
        _print_json(result, scale)
    else:
        typer.echo("\n\n".join(_sections(calculator, result)))


def _mic488(given: Mapping[str, float], options: Mic488MoveOptions) -> tuple[Calculator, UnitScale]:
    from steptwin.calc import Calculator, DriveMechanics, Mic488Model, UnitScale, unit_of
    from steptwin.mic488.config import UNITS

    unit, gear = options.unit, options.gear
    if gear is not None and given:
        raise Misuse("--gear and the mechanics exclude each other: GEAR follows from them")
    if given and "microsteps" not in given:
        raise Misuse("--microsteps is missing: pulses in a full step, as the drive of the motor is set")
    if gear is not None and unit is None:
        raise Misuse("--unit is missing: that of which --gear has the pulses, such as mm")
    own = "mm" if "lead" in given else "rev" if given else "imp"
    own = own if unit is None else unit_of(unit)
    if own not in UNITS:
        raise Misuse(f"unit {own}: a MIC488 has {', '.join(UNITS)}")
    scale = UnitScale.of_gear(own, gear or 1.0) if not given else DriveMechanics(**given).scale()
    if gear is None and not given and own != "imp":
        raise Misuse(f"how many pulses are 1 {own} is not known: give --gear, or --microsteps and the rest of the mechanics")
    return Calculator(Mic488Model(own, scale.in_pulses(own), 1 if options.axis is None else options.axis)), scale


def _m1486(given: Mapping[str, float], options: M1486MoveOptions) -> tuple[Calculator, UnitScale]:
    from steptwin.calc import Calculator, DriveMechanics, M1486Model
    from steptwin.m1486.microsteps import FULL_STEP
    from steptwin.m1486.variants import DEFAULT, variant

    if "microsteps" in given:
        raise Misuse("--microsteps is not for the M1486: it divides its full steps by M itself")
    model = M1486Model(DEFAULT if options.variant is None else variant(options.variant))
    return Calculator(model), DriveMechanics(**{**given, "microsteps": FULL_STEP}).scale()


def _values(calculator: Calculator, scale: UnitScale, given: Mapping[str, object]) -> dict[str, float]:
    """Values in the units of the quantities. Raises `Misuse`."""
    from steptwin.calc import read_quantity

    values: dict[str, float] = {}
    for name, text in given.items():
        quantity = calculator.quantities.get(name)
        if quantity is None:
            can = ", ".join(calculator.quantities)
            raise Misuse(f"{option_of(name)} is not for the {calculator.model.title}: its quantities are {can}")
        try:
            value, unit = read_quantity(str(text), quantity.dimension)
            values[name] = value if unit is None else value * scale.in_pulses(unit) / quantity.pulses
        except Misuse as error:
            raise Misuse(f"{option_of(name)}: {error}") from None
    return values


def _print_json(result: Calculation, scale: UnitScale) -> None:
    from json import dumps

    from steptwin.jsonvalues import to_json

    typer.echo(dumps({**to_json(result), "pulses_per_unit": dict(scale.pulses)}, ensure_ascii=False, indent=2))


def _print_scale(scale: UnitScale, *, json: bool) -> None:
    if json:
        from json import dumps

        typer.echo(dumps({"pulses_per_unit": dict(scale.pulses)}, indent=2))
        return
    typer.echo(table([(unit, f"{pulses:.10g}") for unit, pulses in scale.pulses.items()], ("unit", "pulses in it (GEAR)")))


def _sections(calculator: Calculator, result: Calculation) -> Iterator[str]:
    what = "times" if result.found is None else f"{result.found} = {result.exact:.10g} {result.units[result.found]}".rstrip()
    yield f"{result.title}: {what}"
    codes = {setting.name: setting for setting in result.settings}
    rows = []
    for name, value in result.values.items():
        setting = codes.get(name)
        written = "" if setting is None else _written(setting.code, setting.value)
        rows.append((name, f"{value:.10g}", result.units[name], written))
    yield table(rows, ("quantity", "value", "unit", "set by"))
    yield table(
        [
            (
                one.name,
                f"{one.start_s:.6f}",
                f"{one.duration_s:.6f}",
                f"{one.from_velocity:.6g}",
                f"{one.to_velocity:.6g}",
                f"{one.distance:.8g}",
            )
            for one in result.parts
        ],
        ("part", "begins [s]", "lasts [s]", f"from [{result.units['velocity']}]", "to", f"distance [{result.units['distance']}]"),
    )
    yield table([(calculator.quantities[name].meaning.lower(), f"{seconds:.6f}", "s") for name, seconds in result.times.items()])
    lines = [f"{formula.name}: {formula.text} [{formula.source}]" for formula in result.formulas]
    yield "\n".join([*lines, *(f"note: {note}" for note in result.notes)])


def _written(code: str, value: float) -> str:
    """``M1_ACC = 300``, ``V2000``."""
    return f"{code}{value:g}" if len(code) == 1 else f"{code} = {value:.10g}"
