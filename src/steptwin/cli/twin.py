"""``steptwin pin``, ``encoder``, ``power-cycle``, ``state``: the inputs, power and state of a running twin."""

from __future__ import annotations

import re
from typing import Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.errors import Misuse

_LONGEST_UNIT = 10
"""Digits; a longer number is nobody's unit."""

Twin = Annotated[
    str | None, typer.Option(help="Name of the twin; default: the only one running.", autocompletion=completion.twins)
]
Unit = Annotated[str | None, typer.Option(help="Unit, where the twin serves several: slave address, or address of a chip.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def pin(
    changes: Annotated[
        list[str] | None,
        typer.Argument(help="IN3=1 AIN1=4.2 ...; without any, all pins are shown.", autocompletion=completion.pins),
    ] = None,
    twin: Twin = None,
    unit: Unit = None,
    json: Json = False,
) -> None:
    """Set inputs of a running twin, or show all pins."""
    wanted: dict[str, float] = {}
    for change in changes or []:
        name, equals, value = change.partition("=")
        if not equals:
            raise Misuse(f"{change!r}: expected PIN=VALUE, such as IN3=1 or AIN1=4.2")
        try:
            wanted[name.strip().upper()] = float(value.replace(",", "."))
        except ValueError:
            raise Misuse(f"{change!r}: {value!r} is no number") from None
    pins = _ask(twin, {"do": "pin", "unit": unit, "set": wanted})
    if json:
        _print_json(pins)
    elif not wanted:
        typer.echo("\n".join(f"{name:<6} {value:g}" for name, value in pins.items()))


def encoder(
    changes: Annotated[
        list[str] | None,
        typer.Argument(help="M1+40 or M1-40 turns the shaft by counts; M1=drive, M1=free, M1=blocked says what turns it."),
    ] = None,
    twin: Twin = None,
    unit: Unit = None,
    json: Json = False,
) -> None:
    """Turn, couple or block the encoder shafts of a running twin, or show them."""
    wanted: dict[str, int | str] = {}
    for change in changes or []:
        match = re.fullmatch(r"(?ai)M([1-9]\d{0,8})(?:([+-]\d{1,18})|=(\w+))", change.strip())
        if match is None:
            raise Misuse(f"{change!r}: expected M1+40, M1-40, M1=drive, M1=free or M1=blocked")
        wanted[match[1]] = int(match[2]) if match[2] else match[3].lower()
    shafts = _ask(twin, {"do": "encoder", "unit": unit, "set": wanted})
    if json:
        _print_json(shafts)
    else:
        typer.echo("\n".join(f"M{s['axis']}  {s['counts']:>10} counts, turned by: {s['turned_by']}" for s in shafts))


def power_cycle(twin: Twin = None, unit: Unit = None) -> None:
    """Switch a running twin off and on again."""
    _ask(twin, {"do": "power-cycle", "unit": unit})


def state(twin: Twin = None, unit: Unit = None, json: Json = False) -> None:
    """Show the state of a running twin."""
    shown = _ask(twin, {"do": "state", "unit": unit})
    if json:
        _print_json(shown)
        return
    if shown.get("controller") == "M1486":
        typer.echo("\n".join(_m1486_lines(shown)))
        return
    typer.echo(
        f"firmware {shown['firmware']}, {shown['time_s']:.1f} s after power-on, program {_program_words(shown['program'])}"
    )
    for axis in shown["axes"]:
        unit_name = axis["unit"]
        typer.echo(
            f"M{axis['axis']}  {axis['position']:>12.4f} {unit_name}  {axis['velocity']:>10.3f} {unit_name}/s  "
            f"{axis['status']} {axis['status_text']}"
        )
    on = [name for name, value in shown["pins"].items() if value and not name.startswith("AIN")]
    typer.echo(f"on: {', '.join(on) or 'nothing'}")


def _program_words(program: dict[str, Any]) -> str:
    return f"{program['state']} at line {program['line']}: {program['text']}" if "line" in program else program["state"]


def _m1486_lines(shown: dict[str, Any]) -> list[str]:
    program, motion, buffer = shown["program"], shown["motion"], shown["input_buffer"]
    where = f"{motion['position']}{'' if motion['position_valid'] else ' (not valid)'}, true {motion['true_position']}"
    room = f"input buffer {buffer['waiting']} of {buffer['size']} characters"
    low = [name for name, value in shown["pins"].items() if not value]
    return [
        f"M1486{shown['variant']} at address {shown['address']}, {shown['baud']} bit/s, {shown['time_s']:.1f} s after power-on",
        f"program  {program['does']}{'' if program['next'] is None else ', next: ' + program['next']}",
        f"memory   {program['memory_bits']} of {program['memory_size_bits']} bits, {room}",
        f"position {where}, {motion['velocity']:.1f} step/s, {motion['is']}",
        "settings " + " ".join(f"{name}{shown['settings'][name]}" for name in "SAPVMQN"),
        f"variable {shown['variable']}, flags on: {_numbers(shown['flags_on'])}, functions on: {_numbers(shown['functions_on'])}",
        f"low      {', '.join(low) or 'nothing'}",
    ]


def _numbers(numbers: list[int]) -> str:
    return " ".join(map(str, numbers)) or "none"


def _ask(twin: str | None, request: dict[str, object]) -> Any:
    from steptwin.live.control import ask

    unit = request.get("unit")
    if isinstance(unit, str) and unit.isdecimal() and len(unit) < _LONGEST_UNIT:
        request = {**request, "unit": int(unit)}
    return ask(twin, request)


def _print_json(value: object) -> None:
    import json

    typer.echo(json.dumps(value, indent=2))
