"""What the scripts of a description speak of is there, and takes what they give it: checked before anything runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from steptwin.errors import Misuse
from steptwin.mic488.device import Mic488, check_pin
from steptwin.world import script as do
from steptwin.world.kernel import PinName
from steptwin.world.reader import Path
from steptwin.world.spec import ScriptSpec

if TYPE_CHECKING:
    from steptwin.world.plant import Plant


def check_scripts(plant: Plant, scripts: Iterable[ScriptSpec]) -> None:
    """Raises `WorldError` with every step that cannot be taken."""
    text = plant.spec.text
    for script in scripts:
        if script.when is not None:
            try:
                plant.condition(script.when)
            except Misuse as error:
                text.wrong((*script.path, "when"), "D009", str(error))
        _check(plant, script.steps, (*script.path, "steps" if script.path[0] == "script" else "do"))
    text.check()


def _check(plant: Plant, steps: Iterable[do.Step], path: Path) -> None:
    for n, step in enumerate(steps):
        if isinstance(step, do.Repeat):
            _check(plant, step.steps, (*path, n, "steps"))
        elif (check := _CHECKS.get(type(step))) is not None:
            try:
                check(plant, step)
            except Misuse as error:
                plant.spec.text.wrong((*path, n), "D009", f"step {n + 1}: {error}")


def _condition(plant: Plant, step: do.Until | do.Expect) -> None:
    plant.condition(step.condition)


def _set(plant: Plant, step: do.Set) -> None:
    for name, pin, level in step.levels:
        machine = plant.machine(name)
        plant.plan.kernel_of[name].check(PinName(name, pin))
        if isinstance(machine, Mic488):
            check_pin(pin, level)


def _button(plant: Plant, step: do.Press | do.Release) -> None:
    plant.button(step.button)


def _write(plant: Plant, step: do.Write) -> None:
    for name, values in plant.by_machine(step):
        plant.requests(plant.controller(name, "registers"), values)


def _send(plant: Plant, step: do.Send) -> None:
    plant.line_called(step.line)


def _power_cycle(plant: Plant, step: do.PowerCycle) -> None:
    plant.machine(step.machine)


def _turn(plant: Plant, step: do.Turn) -> None:
    axes = plant.controller(step.machine, "encoder").axes
    if not 1 <= step.axis <= len(axes):
        raise Misuse(f"{step.machine!r} has no M{step.axis}: axes are M1 to M{len(axes)}")


def _fault(plant: Plant, step: do.SetFault) -> None:
    plant.rigging.check(step.fault)


_CHECKS: dict[type, Callable[[Plant, Any], None]] = {
    do.Until: _condition,
    do.Expect: _condition,
    do.Set: _set,
    do.Press: _button,
    do.Release: _button,
    do.Write: _write,
    do.Send: _send,
    do.PowerCycle: _power_cycle,
    do.Turn: _turn,
    do.SetFault: _fault,
}
