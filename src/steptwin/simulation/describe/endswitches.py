"""Warnings about switches at the ends of axes: none where one is named, the wrong contact, and a seek that begins on one."""

from __future__ import annotations

from steptwin.messages import Message
from steptwin.simulation.components.axis import AXIS, AxisSpec
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.switch import SwitchSpec
from steptwin.simulation.describe.overlaps import DOUBTFUL
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.simulation.describe.steptable import STEPS
from steptwin.simulation.kinds.kind import ControllerSpec, EndSwitch
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Seek

NOTHING_JOINED = Message("simulation.no-end-switch", "nothing is joined to {pin}, so this switch never goes on or off")
JOIN_ONE = Message("simulation.join-end-switch-hint", "an [[axis.switch]] with to = '{pin}', or no {key}")
STOPS_ELSEWHERE = Message(
    "simulation.end-switch-stops-elsewhere",
    "{pin} is {level} wherever this switch is off, which for {controller} is on: from there {axis} never moves towards it",
)
OTHER_CONTACT = Message("simulation.other-contact-hint", "contact = '{contact}' here, or level = '{active}' in [{table}]")
SEEKS_NOTHING = Message(
    "simulation.seeks-nothing", "this seek ends at once, without any motion: {pin} is {level} when the world begins"
)
BEGIN_ELSEWHERE = Message(
    "simulation.begin-elsewhere-hint", "another start of {axis}, or a switch on {pin} with contact = '{contact}'"
)


def check_end_switches(spec: WorldSpec, objects: BuiltObjects) -> None:
    """Warn of inputs to which nothing is joined, where the description itself names them, and of switches with the wrong
    contact."""
    axes = {one.drive: one for one in objects.described.of(AXIS)}
    every = [step for script in spec.scripts for step in do.flat(script.steps) if isinstance(step, do.Set)]
    put = {PinName(name, pin.upper()) for step in every for name, pin, _ in step.levels}
    for its in spec.controllers:
        _check_first_seek(spec, objects, its)
        for end in its.kind.end_switches(objects.controllers[its.name]):
            pin, path = PinName(its.name, end.pin), (*its.path, *end.key)
            if pin in objects.driven:
                axis = axes.get((its.name, f"M{end.axis}"))
                if axis is not None and end.stops:
                    _check_contact(spec, objects, axis, end, pin)
            elif pin not in put and spec.text.is_given(path):
                spec.text.warn(path, DOUBTFUL, NOTHING_JOINED(pin=str(pin)), JOIN_ONE(pin=str(pin), key=end.key[-1]))


def _check_contact(spec: WorldSpec, objects: BuiltObjects, axis: AxisSpec, end: EndSwitch, pin: PinName) -> None:
    """Warn where an input stops the axis while all its switches are off, and they are so up to the other end of the travel."""
    circuit = objects.circuits.get(pin)
    switches = [one for one in axis.switches if PinName(*one.target) == pin]
    if circuit is None or not switches or len(switches) != len(circuit.contacts):
        return  # others have a say in it
    closed = [one.contact == "NC" for one in switches]
    level = float(all(closed) if circuit.in_series else any(closed))
    is_up = (end.direction > 0) is not axis.inverted
    if level != end.active or any(_reaches(one, up=not is_up) for one in switches):
        return
    one = switches[0]
    path = (*one.path, "contact") if spec.text.is_given((*one.path, "contact")) else one.path
    contact = "NO" if closed[0] else "NC"
    text = STOPS_ELSEWHERE(pin=str(pin), level=int(level), controller=pin.controller, axis=axis.name)
    active = "active low" if level else "active high"
    spec.text.warn(path, DOUBTFUL, text, OTHER_CONTACT(contact=contact, active=active, table=f"{axis.drive[0]}.{pin.pin}"))


def _check_first_seek(spec: WorldSpec, objects: BuiltObjects, its: ControllerSpec) -> None:
    """Warn where nothing of the description moves the switches that a seek ends at before it."""
    moving = [
        (script, n, step)
        for script in spec.scripts
        for n, one in enumerate(script.steps)
        for step in do.flat([one])
        if (isinstance(step, do.Order) and step.command.controller == its.name)
        or (isinstance(step, do.Send) and step.line == its.line)
    ]
    script, n, step = moving[0] if moving else (None, 0, None)
    if script is None or any(other is not script for other, *_ in moving) or any(its.kind.files(its)):
        return
    if not isinstance(step, do.Order) or not isinstance(step.command, Seek):
        return
    pin = PinName(its.name, step.command.pin)
    switches = [
        (axis, one)
        for axis in objects.described.of(AXIS)
        for one in axis.switches
        if axis.drive[0] == its.name and PinName(*one.target) == pin
    ]
    circuit, controller = objects.circuits.get(pin), objects.controllers[its.name]
    if circuit is None or len(switches) != len(circuit.contacts) or not its.kind.would_end_seek(controller, pin.pin):
        return
    axis, one = switches[0]
    contact = "NO" if one.contact == "NC" else "NC"
    text = SEEKS_NOTHING(pin=str(pin), level=int(its.kind.state.pin(controller, pin.pin, 0)))
    hint = BEGIN_ELSEWHERE(axis=axis.name, pin=str(pin), contact=contact)
    spec.text.warn((*script.path, STEPS.name, n), DOUBTFUL, text, hint)


def _reaches(switch: SwitchSpec, *, up: bool) -> bool:
    """Whether it is on up to the upper or lower end."""
    return (switch.above if up else switch.below) is not None
