"""Checks of names and values in steps, before a world runs or a step is executed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message
from steptwin.simulation.describe.overlaps import DOUBTFUL
from steptwin.simulation.describe.spec import ScriptSpec
from steptwin.simulation.describe.steptable import STEPS
from steptwin.simulation.faults import Fault
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Seek
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.world.actions import prepare
from steptwin.simulation.world.inputs import FOR_SCRIPTS, ExternalInput
from steptwin.simulation.world.model import Model
from steptwin.simulation.world.motions import motion_ends, ordered
from steptwin.tables import complete

SETS_DRIVEN = Message("simulation.sets-driven", "{pin} is driven from {where}: this level lasts only until that drives it again")
STUCK_INSTEAD = Message(
    "simulation.stuck-instead-hint",
    "{{ fault = {{ kind = 'stuck', machine = '{name}', pin = '{pin}', value = {level:g} }} }} holds it",
)


def check_scripts(model: Model, scripts: Sequence[ScriptSpec]) -> None:
    """Report every invalid step in the text of the description."""
    text = model.spec.text
    set_somewhere = [step.fault for script in scripts for step in do.flat(script.steps) if isinstance(step, do.SetFault)]
    for script in scripts:
        if script.when is not None:
            try:
                model.condition(script.when)
            except Misuse as error:
                text.wrong_reference((*script.path, "when"), error)
        _check(model, script.steps, (*script.path, STEPS.name), set_somewhere)


def check_faults(model: Model, faults: Sequence[Fault | None]) -> None:
    """Set the faults of the description; report impossible ones."""
    for n, fault in enumerate(faults):
        if fault is not None and not _is_on_something_broken(model, fault):
            try:
                model.put_fault(fault)
            except Misuse as error:
                model.spec.text.wrong_reference(("fault", n), error)


def _is_on_something_broken(model: Model, fault: Fault) -> bool:
    """Whether a fault concerns, or may concern, a controller or line whose own table has errors."""
    text = model.spec.text
    named = [str(name) for key in ("machine", "line", "element") if (name := fault.get(key)) is not None]
    return any(map(text.may_be_broken, named)) if named else text.is_any_wrong(*text.controllers, "line", "axis")


def _check(model: Model, steps: Iterable[do.Step], path: Path, set_somewhere: Sequence[Fault]) -> None:
    text = model.spec.text
    for n, step in enumerate(steps):
        if isinstance(step, do.Repeat) and not step.is_one:
            _check(model, step.steps, (*path, n, STEPS.name), set_somewhere)
            continue
        if isinstance(step, do.ClearFault) and (
            any(_may_be_called(fault, step.name) for fault in set_somewhere) or text.is_any_wrong("fault", "event", "script")
        ):
            continue
        if isinstance(step, do.SetFault) and _is_on_something_broken(model, step.fault):
            continue
        for part in _parts(step):
            try:
                check_step(model, part)
                if isinstance(part, do.Set):
                    _warn_of_driven(model, part, (*path, n))
            except Misuse as error:
                text.wrong_reference((*path, n), error, f"step {n + 1}: ")


def _warn_of_driven(model: Model, step: do.Set, path: Path) -> None:
    """Warn of a level for an input that something else sets as well."""
    ((name, given, level),) = step.levels
    pin = PinName(name, model.input_pin(name, given, level))
    its = model.objects.driven.get(pin)
    if its is not None:
        message = SETS_DRIVEN(pin=str(pin), where=model.spec.text.where(its))
        model.spec.text.warn(
            (*path, "set", f"{name}.{given}"), DOUBTFUL, message, STUCK_INSTEAD(name=name, pin=pin.pin, level=level)
        )


def _parts(step: do.Step) -> Sequence[do.Step]:
    """A step split into parts that are checked separately."""
    if isinstance(step, do.Repeat):
        return step.steps[:1]
    if isinstance(step, do.Set):
        return [replace(step, levels=(level,)) for level in step.levels]
    if isinstance(step, do.Write):
        return [replace(step, values=(value,)) for value in step.values]
    return [step]


def _may_be_called(fault: Fault, name: str) -> bool:
    """Whether a fault may have this name: its own, or its kind with a number if it has none."""
    kind, _, number = name.rpartition("-")
    return name == fault.name or (not fault.name and fault.kind.name in (name, kind if number.isdecimal() else name))


def check_step(model: Model, step: ExternalInput) -> None:
    """Raises `Misuse` for a step with unknown names or invalid values."""
    with suppress(Refusal):  # what cannot be done now may be possible later
        _CHECKS.get(type(step), prepare)(model, step)


def _condition(model: Model, step: do.Until) -> None:
    model.condition(step.condition)


def _order(model: Model, step: do.Order) -> None:
    command = step.command
    motion_ends(model, command.controller, command.axis)
    with suppress(Refusal):
        check_step(model, ordered(model, command))
    if isinstance(command, Seek):
        model.condition(motion_ends(model, command.controller, command.axis, command).reached)


def _motion(model: Model, step: do.UntilOver | do.ExpectReached) -> None:
    motion_ends(model, step.controller, step.axis)


def _nothing(model: Model, step: object) -> None:
    """No check: the step has no names, or is checked when it is executed."""


_CHECKS: Mapping[type, Callable[[Model, Any], object]] = complete(
    "step of scripts",
    FOR_SCRIPTS,
    "check",
    {
        do.Until: _condition,
        do.Order: _order,
        do.UntilOver: _motion,
        do.ExpectReached: _motion,
        **dict.fromkeys((do.Wait, do.At, do.Stop, do.Read, do.Call, do.Repeat), _nothing),
    },
)
"""The checks of steps that only scripts execute. What the others name is found where they are prepared."""
