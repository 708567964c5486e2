"""The actions of steps and of external programs on a world, at the present moment."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import Any, get_args

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
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
from steptwin.simulation.world.model import Model
from steptwin.simulation.world.scripts import Scripts
from steptwin.simulation.world.worldprograms import name_of_text
from steptwin.tables import complete
from steptwin.wire.rtu import encode_frame


def act(model: Model, scripts: Scripts, what: ExternalInput) -> None:
    """Execute an external input. Raises `Misuse` for unknown names, and for steps that only scripts can execute."""
    action = ACTIONS.get(type(what))
    if action is None:
        raise Misuse(f"{what}: only scripts can execute this step")
    action(model, scripts, what)


def _record(model: Model, controller: str, what: str, value: object) -> None:
    model.trace.add(TraceRecord(model.now, controller, "input", what, value))


@contextmanager
def _now(model: Model, name: str) -> Generator[Scheduler]:
    """The scheduler of a controller or line, advanced to the present; it propagates signals after the action."""
    scheduler = model.sync(name)
    yield scheduler
    scheduler.notify(name)
    scheduler.propagate()


def _set(model: Model, scripts: Scripts, step: do.Set) -> None:
    for name, pin, value in step.levels:
        known = model.input_pin(name, pin, value)
        scheduler = model.sync(name)  # as `_now`, but with hundreds of levels at a moment
        scheduler.set_input(PinName(name, known), value)
        scheduler.notify(name)
        scheduler.propagate()


def _press(model: Model, scripts: Scripts, step: do.Press) -> None:
    _move_button(model, scripts, step.button, pressed=True)
    if step.duration is not None:
        scripts.schedule(_releasing(step.button), (do.Wait(step.duration), do.Release(step.button)))


def _release(model: Model, scripts: Scripts, step: do.Release) -> None:
    _move_button(model, scripts, step.button, pressed=False)


_RELEASE = "release "


def _releasing(button: str) -> str:
    """The name of the script that releases a button after a time. Scripts of a description have no blank in their names."""
    return f"{_RELEASE}{button}"


def _downloading(controller: str) -> str:
    """The name of the script that types a text into a controller."""
    return f"download {controller}"


def _is_release(script: str) -> bool:
    return script.startswith(_RELEASE)


def _move_button(model: Model, scripts: Scripts, name: str, *, pressed: bool) -> None:
    button, _ = model.button(name)
    scripts.unschedule(_releasing(name))
    with _now(model, button.controller):
        _record(model, button.controller, name, "pressed" if pressed else "released")
        button.press(pressed, model.now)


def _write(model: Model, scripts: Scripts, step: do.Write) -> None:
    parts, now = model.parts, model.now
    for name, values in model.by_controller(step):
        scheduler = model.sync(name)  # as `_now` does: every write of every script comes here
        controller, on = parts.controllers[name], parts.line_of.get(name)
        for pdu in model.requests(name, values):
            if on is not None:
                line, unit = on
                line.master.ask(encode_frame(unit, pdu), ANSWER_NS, now)
            else:
                _record(model, name, "request", pdu)
                model.registers(name).execute(controller, pdu, now)
        scheduler.notify(name if on is None else on[0].name)
        scheduler.propagate()


def _halt(model: Model, scripts: Scripts, given: Halt) -> None:
    with _now(model, given.controller):
        on = model.parts.line_of.get(given.controller)
        if on is not None:
            line, unit = on
            line.recall(unit, model.now)
        _record(model, given.controller, "stop", given.scope)
        scripts.unschedule(_downloading(given.controller))
        model.kind(given.controller).halt(model.controller(given.controller), given, model.now)


def _end_scripts(model: Model, scripts: Scripts, given: EndScripts) -> None:
    scripts.end_described(_is_release)


def _request(model: Model, scripts: Scripts, step: do.Request) -> None:
    line = model.line_called(step.line)
    with _now(model, step.line):
        line.master.ask(encode_frame(step.unit, step.pdu), step.within, model.now)


def _send(model: Model, scripts: Scripts, step: do.Send) -> None:
    line = model.line_called(step.line)
    with _now(model, step.line):
        line.receive(SCRIPTS, step.data, model.now)


def _bytes(model: Model, scripts: Scripts, given: Bytes) -> None:
    line = model.line_called(given.line)
    with _now(model, given.line):
        line.connect(given.place, given.kind)
        line.receive(given.place, given.data, model.now)


def _see(model: Model, scripts: Scripts, given: See) -> None:
    vision = model.vision(given.controller)
    with _now(model, given.controller):
        _record(model, given.controller, "vision", given[1:])
        vision.see(model.controller(given.controller), given[1:], model.now)


def _download(model: Model, scripts: Scripts, given: Download) -> None:
    kind = model.kind(given.controller)
    if not kind.offers(ControllerKind.download):
        raise kind.lacks(given.controller, "program memory")
    with _now(model, given.controller):
        on = model.parts.line_of.get(given.controller)
        source = SourceText(name_of_text(model, given.controller, given.place), given.text)
        to = Destination(given.controller, None if on is None else on[0].name, given.place)
        found = kind.download(model.controller(given.controller), to, source)
        found.put(model.now)
        _record(model, given.controller, "download", given.place)
        model.downloaded[given.controller, given.place] = source
    if found.typed:
        scripts.schedule(_downloading(given.controller), found.typed)


def _set_variable(model: Model, scripts: Scripts, given: SetVariable) -> None:
    with _now(model, given.controller):
        model.programs_of(given.controller).set_variable(given.name, given.value, model.now)


def _leave(model: Model, scripts: Scripts, given: Leave) -> None:
    line = model.line_called(given.line)
    model.sync(given.line)
    line.leave(given.place)


def _refused(model: Model, scripts: Scripts, given: Refused) -> None:
    model.report_refused(given.text)


def _power_cycle(model: Model, scripts: Scripts, step: do.PowerCycle) -> None:
    controller = model.controller(step.controller)
    with _now(model, step.controller):
        _record(model, step.controller, "power-cycle", "")
        controller.power_cycle(model.now)


def _turn(model: Model, scripts: Scripts, step: do.Turn) -> None:
    encoders = model.encoders(step.controller)
    with _now(model, step.controller):
        _record(model, step.controller, f"M{step.axis} turned", step.counts)
        encoders.reader(model.controller(step.controller)).turn_encoder(step.axis, step.counts, model.now)


def _couple(model: Model, scripts: Scripts, step: do.Couple) -> None:
    encoders = model.encoders(step.controller)
    with _now(model, step.controller):
        _record(model, step.controller, f"M{step.axis} coupled", step.coupling)
        encoders.couple(model.controller(step.controller), step.axis, step.coupling, model.now)


def _set_fault(model: Model, scripts: Scripts, step: do.SetFault) -> None:
    model.put_fault(step.fault)


def _clear_fault(model: Model, scripts: Scripts, step: do.ClearFault) -> None:
    faults = model.parts.faults
    if step.name in (active.name for active in faults.active):  # otherwise it was cleared already or is not set yet
        model.sync_all()
        faults.remove(step.name, model.now)


def _expect(model: Model, scripts: Scripts, step: do.Expect) -> None:
    model.expect(step.condition)


def _note(model: Model, scripts: Scripts, step: do.Note) -> None:
    if model.trace.watchers:
        model.sync_all()  # earlier events are shown first

    model.trace.add(TraceRecord(model.now, "world", "event", "note", step.text))


ACTIONS: Mapping[type, Callable[[Model, Scripts, Any], None]] = complete(
    "step",
    [kind for kind in get_args(ExternalInput) if kind not in FOR_SCRIPTS],
    "action",
    {
        do.Set: _set,
        do.Press: _press,
        do.Release: _release,
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
