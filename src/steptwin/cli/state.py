"""``steptwin state``: the state of a running twin.

From Python: `steptwin.live.remote.RemoteSubject`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer

from steptwin.cli.device import Json, Twin
from steptwin.cli.selected import print_data, selected

if TYPE_CHECKING:
    from steptwin.controllerstate import ControllerState, StateAxis
    from steptwin.datasheet import Datasheet, Pin


def command(twin: Twin = None, json: Json = False) -> None:
    """Show the state of a running twin."""
    from steptwin.subject.commands import ReadState

    with selected(twin) as there:
        name = there.one()
        found = there.do(ReadState(name))
    if json:
        print_data(found)
        return
    from steptwin.controllerstate import ControllerState
    from steptwin.jsonvalues import read

    typer.echo("\n".join(_lines(read(ControllerState, found), there.sheet(name))))


def _lines(state: ControllerState, sheet: Datasheet) -> Iterator[str]:
    from steptwin.controllerstate import detail_text

    since = "" if state.time_s is None else f", {state.time_s:.1f} s after power-on"
    yield f"{sheet.title} {state.variant}".rstrip() + f"{since}: {state.status.text}"
    yield f"program {state.program.text}"
    if state.program.variables:
        named = (f"{name} = {value:.7g}" for name, value in state.program.variables.items())
        yield f"variables: {', '.join(named)}"
    yield from map(_axis, state.axes)
    yield from _pins(state, sheet.pins)
    width = max((len(detail.name) for detail in sheet.details), default=0)
    for detail in sheet.details:
        yield f"{detail.name:<{width}} {detail_text(state.details.get(detail.name))} {detail.unit}".rstrip()


def _axis(axis: StateAxis) -> str:
    position = "unknown" if axis.position is None else f"{axis.position:.4f}"
    velocity = "unknown" if axis.velocity is None else f"{axis.velocity:.3f}"
    code = "" if axis.status.code is None else f"{axis.status.code} "
    return f"{axis.name}  {position:>12} {axis.unit}  {velocity:>10} {axis.unit}/s  {code}{axis.status.text}"


def _pins(state: ControllerState, pins: tuple[Pin, ...]) -> Iterator[str]:
    """Digital pins that are active."""
    on = [pin.name for pin in pins if not (pin.is_analog or pin.is_active_low) and state.pins.get(pin.name) == 1]
    yield f"on: {', '.join(on) or 'nothing'}"
    if any(pin.is_active_low for pin in pins):
        low = [pin.name for pin in pins if pin.is_active_low and state.pins.get(pin.name) == 0]
        yield f"low: {', '.join(low) or 'nothing'}"
