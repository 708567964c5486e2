"""``steptwin calc``: any quantity of a move from the others.

From Python: `steptwin.calc.Calculator`.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json, table
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.calc import Calculation, Calculator, Scale


class Kind(enum.StrEnum):
    MIC488 = "mic488"
    M1486 = "m1486"


def _value(meaning: str) -> typer.models.OptionInfo:
    return typer.Option(help=meaning, metavar="VALUE")


def calc(
    kind: Annotated[Kind, typer.Argument(metavar="KIND", help="mic488 or m1486.")],
    distance: Annotated[str | None, _value("Distance: 150mm, 2.5rev, 96000.")] = None,
    velocity: Annotated[str | None, _value("Velocity (VMAX, V): 60mm/s, 600rpm.")] = None,
    acceleration: Annotated[str | None, _value("Acceleration (ACC, A): 300mm/s2.")] = None,
    deceleration: Annotated[str | None, _value("Deceleration (DEC) of a MIC488; as the acceleration without.")] = None,
    start_stop: Annotated[str | None, _value("Start/stop velocity (S) of an M1486.")] = None,
    profile: Annotated[str | None, _value("Profile point (P) of an M1486; none without.")] = None,
    time: Annotated[str | None, _value("Total time: 2s, 250ms.")] = None,
    acceleration_time: Annotated[str | None, _value("Time of acceleration.")] = None,
    constant_time: Annotated[str | None, _value("Time at constant velocity.")] = None,
    deceleration_time: Annotated[str | None, _value("Time of deceleration.")] = None,
    find: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="What a time determines. Default: the one that is left out.")
    ] = None,
    motor_steps: Annotated[float | None, typer.Option(help="Full steps in a revolution of the motor. Default: 200.")] = None,
    microsteps: Annotated[float | None, typer.Option(help="Pulses in a full step of a MIC488, as its drive is set.")] = None,
    ratio: Annotated[float | None, typer.Option(help="Revolutions of the motor in one of what it drives. Default: 1.")] = None,
    lead: Annotated[
        float | None, typer.Option(help="Travel in one revolution: lead of a screw, teeth × pitch of a pulley [mm].")
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT",
            help="Of a MIC488: imp, rev, degree, mm, cm, m. Default: mm with --lead, rev with --microsteps, else imp.",
        ),
    ] = None,
    gear: Annotated[float | None, typer.Option(help="GEAR of a MIC488, pulses in a unit, instead of its mechanics.")] = None,
    axis: Annotated[int | None, typer.Option(help="Axis of a MIC488, for the names of registers. Default: 1.")] = None,
    variant: Annotated[
        str | None, typer.Option(metavar="TYPE", help="Type of an M1486. Default: A.", autocompletion=completion.variants)
    ] = None,
    microstep: Annotated[int | None, typer.Option("--microstep", "-M", help="M of an M1486. Default: 4.")] = None,
    qualification: Annotated[int | None, typer.Option("--qualification", "-Q", help="Q of an M1486. Default: 1.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="A picture of the profile: FILE.svg or FILE.png.")] = None,
    json: Json = False,
) -> None:
    """Calculate a move: its times, or with a time the quantity that is left out; and GEAR from the mechanics.

    Values have units: of distance imp, step, rev, degree, mm, cm, m, with /s or /s2 behind them, of time s, ms, min; a number
    alone is in the controller's own unit. Exit code 2 where a value is outside its range or a time cannot be.
    """
    from steptwin.calc import plain

    mechanics = {"motor_steps": motor_steps, "microsteps": microsteps, "ratio": ratio, "lead": lead}
    given_mechanics = {name: value for name, value in mechanics.items() if value is not None}
    if kind is Kind.MIC488:
        _refuse(kind, {"variant": variant})
        calculator, scale = _mic488(given_mechanics, unit, gear, axis)
    else:
        _refuse(kind, {"unit": unit, "gear": gear, "axis": axis, "microsteps": microsteps})
        calculator, scale = _m1486(given_mechanics, variant)
    texts = {
        "distance": distance, "velocity": velocity, "acceleration": acceleration, "deceleration": deceleration,
        "start_stop": start_stop, "profile": profile, "time": time, "acceleration_time": acceleration_time,
        "constant_time": constant_time, "deceleration_time": deceleration_time,
        "microstep": None if microstep is None else str(microstep),
        "qualification": None if qualification is None else str(qualification),
    }  # fmt: skip
    given = _given(calculator, scale, {name: text for name, text in texts.items() if text is not None})
    if not given and given_mechanics and find is None and output is None:
        _print_scale(scale, json=json)
        return
    result = calculator.calculate(given, None if find is None else find.replace("-", "_"))
    if output is not None:
        from steptwin.files.export import write_profile

        write_profile(result, output)
    if json:
        from json import dumps

        typer.echo(dumps({**plain(result), "pulses_per_unit": dict(scale.pulses)}, ensure_ascii=False, indent=2))
    else:
        typer.echo("\n\n".join(_sections(calculator, result)))


def _refuse(kind: Kind, options: Mapping[str, object]) -> None:
    for name, value in options.items():
        if value is not None:
            raise Misuse(f"--{name.replace('_', '-')} is not for the {kind.upper()}")


def _mic488(given: Mapping[str, float], unit: str | None, gear: float | None, axis: int | None) -> tuple[Calculator, Scale]:
    from steptwin.calc import Calculator, Mechanics, Mic488Model, Scale, unit_of
    from steptwin.mic488.config import UNITS

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
    scale = Scale.of_gear(own, gear or 1.0) if not given else Mechanics(**given).scale()
    if gear is None and not given and own != "imp":
        raise Misuse(f"how many pulses are 1 {own} is not known: give --gear, or --microsteps and the rest of the mechanics")
    return Calculator(Mic488Model(own, scale.in_pulses(own), 1 if axis is None else axis)), scale


def _m1486(given: Mapping[str, float], variant: str | None) -> tuple[Calculator, Scale]:
    from steptwin.calc import Calculator, M1486Model, Mechanics
    from steptwin.m1486.microsteps import FULL_STEP
    from steptwin.m1486.variants import DEFAULT
    from steptwin.m1486.variants import variant as variant_of

    model = M1486Model(DEFAULT if variant is None else variant_of(variant))
    return Calculator(model), Mechanics(**{**given, "microsteps": FULL_STEP}).scale()


def _given(calculator: Calculator, scale: Scale, texts: Mapping[str, str]) -> dict[str, float]:
    """Values in the units of the quantities. Raises `Misuse`."""
    from steptwin.calc import read_quantity

    values: dict[str, float] = {}
    for name, text in texts.items():
        quantity = calculator.quantities.get(name)
        if quantity is None:
            can = ", ".join(calculator.quantities)
            raise Misuse(f"--{name.replace('_', '-')} is not for the {calculator.model.title}: its quantities are {can}")
        try:
            value, unit = read_quantity(text, quantity.dimension)
            values[name] = value if unit is None else value * scale.in_pulses(unit) / quantity.pulses
        except Misuse as error:
            raise Misuse(f"--{name.replace('_', '-')}: {error}") from None
    return values


def _print_scale(scale: Scale, *, json: bool) -> None:
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
