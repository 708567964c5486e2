"""The actions of steps and of external programs on a world.

A step is prepared at the moment at which it is executed: its names are found, its values checked and encoded, and nothing has
changed yet. What is prepared is then done. A check of a step is a preparation that nobody executes.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import Any, TypeAlias, get_args

from steptwin.controller import Fact
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.faults.answers import NEVER_SENT
from steptwin.simulation.kinds.kind import ControllerKind
from steptwin.simulation.kinds.lines import SCRIPTS
from steptwin.simulation.kinds.master import ANSWER_NS
from steptwin.simulation.kinds.programtexts import Destination
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Halt
from steptwin.simulation.world.inputs import (
    FOR_SCRIPTS,
    Bytes,
    Download,
    EndScripts,
    ExternalInput,
    Leave,
    Refused,
    See,
    SetVariable,
)
from steptwin.simulation.world.model import WORLD, Model
from steptwin.simulation.world.putting import Act, put, remove
from steptwin.simulation.world.scripts import Scripts
from steptwin.simulation.world.worldprograms import name_of_text
from steptwin.tables import complete
from steptwin.wire.pdu import REFUSED
from steptwin.wire.rtu import encode_frame

Action: TypeAlias = Callable[[Scripts], object]
"""A prepared step; it is done at the moment of its preparation."""


def prepare(model: Model, what: ExternalInput) -> Action:
    """The action of a step now. Raises `Misuse` for unknown names, invalid values, and steps that only scripts can execute;
    `Refusal` for what cannot be done now."""
    found = ACTIONS.get(type(what))
    if found is None:
        raise Misuse(f"{what}: only scripts can execute this step")
    return found(model, what)


def _record(model: Model, controller: str, what: str, value: object, *facts: Fact) -> None:
    model.trace.add(TraceRecord(model.now, controller, "input", what, value, facts))


@contextmanager
def _now(model: Model, name: str) -> Generator[Scheduler]:
    """The scheduler of a controller or line, advanced to the present; it propagates signals after the action."""
    scheduler = model.sync(name)
    yield scheduler
    scheduler.notify(name)
    scheduler.propagate()


def _set(model: Model, step: do.Set) -> Action:
    levels = [(PinName(name, model.input_pin(name, pin, value)), value) for name, pin, value in step.levels]

    def action(scripts: Scripts) -> None:
        for pin, value in levels:
            scheduler = model.sync(pin.controller)  # as `_now`, but with hundreds of levels at a moment
            scheduler.set_input(pin, value)
            scheduler.notify(pin.controller)
            scheduler.propagate()

    return action


def _press(model: Model, step: do.Press) -> Action:
    press = _button(model, step.button, pressed=True)

    def action(scripts: Scripts) -> None:
        press(scripts)
        if step.duration is not None:
            scripts.schedule(_releasing(step.button), (do.Wait(step.duration), do.Release(step.button)))

    return action


def _release(model: Model, step: do.Release) -> Action:
    return _button(model, step.button, pressed=False)


_RELEASE = "release "


def _releasing(button: str) -> str:
    """The name of the script that releases a button after a time. Scripts of a description have no blank in their names."""
    return f"{_RELEASE}{button}"


def _downloading(controller: str) -> str:
    """The name of the script that types a text into a controller."""
    return f"download {controller}"


def is_release(script: str) -> bool:
    """Whether it is the name of the script that ends a press of limited duration."""
    return script.startswith(_RELEASE)


def _button(model: Model, name: str, *, pressed: bool) -> Action:
    button, _ = model.button(name)

    def action(scripts: Scripts) -> None:
        scripts.unschedule(_releasing(name))
        with _now(model, button.controller):
            _record(model, button.controller, name, "pressed" if pressed else "released")
            button.press(pressed, model.now)

    return action


def _put(model: Model, step: do.Put) -> Action:
    model.sync_all()
    return _of_workpiece(model, put(model, step.on, step.front), step.on, "put")


def _remove(model: Model, step: do.Remove) -> Action:
    model.sync_all()
    return _of_workpiece(model, remove(model, step.workpiece), step.workpiece, "removed")


def _of_workpiece(model: Model, act: Act, name: str, what: str) -> Action:
    def action(scripts: Scripts) -> None:
        _record(model, act.scheduler.first, name, what, ("element", name.partition(".")[0]))
        act.do(model.now)
        act.scheduler.propagate()

    return action


def _write(model: Model, step: do.Write) -> Action:
    requests = model.requests(step)

    def action(scripts: Scripts) -> None:
        objects, now = model.objects, model.now
        for name, pdus in requests:
            scheduler, on = model.sync(name), objects.line_of.get(name)
            if on is not None:
                line, unit = on
                for pdu in pdus:
                    line.master.ask(encode_frame(unit, pdu), ANSWER_NS, now)
            else:
                for pdu in pdus:
                    _record(model, name, "request", pdu)
                    answer = model.registers(name).execute(objects.controllers[name], pdu, now)
                    if answer and answer[0] & REFUSED and answer[1] != NEVER_SENT:
                        scripts.refused.append((name, answer))
            scheduler.notify(name if on is None else on[0].name)
            scheduler.propagate()

    return action


WRONG_HALT_OF_A_PROGRAM = Message("simulation.wrong-halt-of-a-program", "program = {program!r}: permitted are pause and stop")
WRONG_AXIS_TO_HALT = Message(
    "simulation.wrong-axis-to-halt", "axis = {axis}: {controller!r} is {title}, which has axes 1 to {most}"
)


def _halt(model: Model, given: Halt) -> Action:
    kind, controller = model.kind(given.controller), model.controller(given.controller)
    if given.program not in (None, "pause", "stop"):
        raise Misuse(WRONG_HALT_OF_A_PROGRAM(program=given.program))
    if given.axis is not None and not 1 <= given.axis <= len(controller.axes):
        most = len(controller.axes)
        raise Misuse(WRONG_AXIS_TO_HALT(axis=given.axis, controller=given.controller, title=kind.title, most=most))

    def action(scripts: Scripts) -> None:
        with _now(model, given.controller):
            on = model.objects.line_of.get(given.controller)
            if on is not None:
                line, unit = on
                line.recall(unit, model.now)
            _record(model, given.controller, "stop", given.scope)
            scripts.unschedule(_downloading(given.controller))
            kind.halt(controller, given, model.now)

    return action


def _end_scripts(model: Model, given: EndScripts) -> Action:
    return lambda scripts: scripts.end_described(is_release)


def _request(model: Model, step: do.Request) -> Action:
    master = model.line_called(step.line).master

    def action(scripts: Scripts) -> None:
        with _now(model, step.line):
            master.ask(encode_frame(step.unit, step.pdu), step.within, model.now)

    return action


def _send(model: Model, step: do.Send) -> Action:
    line = model.line_called(step.line)

    def action(scripts: Scripts) -> None:
        with _now(model, step.line):
            line.receive(SCRIPTS, step.data, model.now)

    return action


def _bytes(model: Model, given: Bytes) -> Action:
    line = model.line_called(given.line)

    def action(scripts: Scripts) -> None:
        with _now(model, given.line):
            line.connect(given.place, given.kind)
            line.receive(given.place, given.data, model.now)

    return action


def _see(model: Model, given: See) -> Action:
    vision, controller = model.vision(given.controller), model.controller(given.controller)

    def action(scripts: Scripts) -> None:
        with _now(model, given.controller):
            _record(model, given.controller, "vision", given[1:])
            vision.see(controller, given[1:], model.now)

    return action


def _download(model: Model, given: Download) -> Action:
    kind = model.kind(given.controller)
    if not kind.offers(ControllerKind.download):
        raise kind.lacks(given.controller, "program memory")
    model.sync(given.controller)
    on = model.objects.line_of.get(given.controller)
    source = SourceText(name_of_text(model, given.controller, given.place), given.text)
    to = Destination(given.controller, None if on is None else on[0].name, given.place)
    found = kind.download(model.controller(given.controller), to, source)

    def action(scripts: Scripts) -> None:
        with _now(model, given.controller):
            found.put(model.now)
            _record(model, given.controller, "download", given.place)
            model.downloaded[given.controller, given.place] = source
        if found.typed:
            scripts.schedule(_downloading(given.controller), found.typed)

    return action


def _set_variable(model: Model, given: SetVariable) -> Action:
    programs = model.programs_of(given.controller)

    def action(scripts: Scripts) -> None:
        with _now(model, given.controller):
            programs.set_variable(given.name, given.value, model.now)

    return action


def _leave(model: Model, given: Leave) -> Action:
    line = model.line_called(given.line)

    def action(scripts: Scripts) -> None:
        model.sync(given.line)
        line.leave(given.place)

    return action


def _refused(model: Model, given: Refused) -> Action:
    return lambda scripts: model.report_refused(given.text)


IS_SWITCHED_BY_A_SUPPLY = Message(
    "simulation.is-switched-by-a-supply",
    "{controller!r} is switched by its supply {supply!r}: switch that, or let it have a brown-out",
)


def _power_cycle(model: Model, step: do.PowerCycle) -> Action:
    controller, supply = model.controller(step.controller), model.objects.supplied.get(step.controller)
    if supply is not None:
        raise Misuse(IS_SWITCHED_BY_A_SUPPLY(controller=step.controller, supply=supply))

    def action(scripts: Scripts) -> None:
        with _now(model, step.controller):
            _record(model, step.controller, "power-cycle", "")
            controller.power_cycle(model.now)

    return action


def _turn(model: Model, step: do.Turn) -> Action:
    encoders, controller = model.encoders(step.controller), model.controller(step.controller)
    encoders.check_turn(step.axis, step.counts)

    def action(scripts: Scripts) -> None:
        with _now(model, step.controller):
            _record(model, step.controller, f"M{step.axis} turned", step.counts)
            encoders.reader(controller).turn_encoder(step.axis, step.counts, model.now)

    return action


ENCODER_OF_AN_AXIS = Message("simulation.encoder-of-an-axis", "{drive}: its encoder is part of the mechanics of axis {name!r}")


def _couple(model: Model, step: do.Couple) -> Action:
    encoders, controller = model.encoders(step.controller), model.controller(step.controller)
    encoders.check_turn(step.axis, 0)
    drive = step.controller, f"M{step.axis}"
    for axis in model.axes.values():
        if axis.spec.drive == drive:
            raise Misuse(ENCODER_OF_AN_AXIS(drive=".".join(drive), name=axis.spec.name))

    def action(scripts: Scripts) -> None:
        with _now(model, step.controller):
            _record(model, step.controller, f"M{step.axis} coupled", step.coupling)
            encoders.couple(controller, step.axis, step.coupling, model.now)

    return action


def _set_fault(model: Model, step: do.SetFault) -> Action:
    model.fault_setup.check(step.fault)
    return lambda scripts: model.put_fault(step.fault)


def _clear_fault(model: Model, step: do.ClearFault) -> Action:
    faults = model.objects.faults
    faults.called(step.name)

    def action(scripts: Scripts) -> None:
        model.sync_all()
        faults.remove(step.name, model.now)

    return action


def _expect(model: Model, step: do.Expect) -> Action:
    model.condition(step.condition)
    return lambda scripts: model.expect(step.condition)


def _note(model: Model, step: do.Note) -> Action:
    def action(scripts: Scripts) -> None:
        if model.trace.subscribers:
            model.sync_all()  # earlier events are shown first
        model.trace.add(TraceRecord(model.now, WORLD, "event", "note", step.text))

    return action


ACTIONS: Mapping[type, Callable[[Model, Any], Action]] = complete(
    "step",
    [kind for kind in get_args(ExternalInput) if kind not in FOR_SCRIPTS],
    "action",
    {
        do.Set: _set,
        do.Press: _press,
        do.Release: _release,
        do.Put: _put,
        do.Remove: _remove,
        do.Write: _write,
        do.Request: _request,
        do.Send: _send,
        do.PowerCycle: _power_cycle,
        do.Turn: _turn,
        do.Couple: _couple,
        do.SetFault: _set_fault,
        do.ClearFault: _clear_fault,
        do.Expect: _expect,
        do.Note: _note,
        Bytes: _bytes,
        See: _see,
        Download: _download,
        SetVariable: _set_variable,
        Leave: _leave,
        Refused: _refused,
        Halt: _halt,
        EndScripts: _end_scripts,
    },
)
