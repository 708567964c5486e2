"""Builds controllers and schedulers from a description: one scheduler for all that is connected by wires, lines and mechanics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from steptwin.controller import ControllerEvent, Nanos
from steptwin.errors import Misuse
from steptwin.simulation.components.beltspace import add_belts
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.components.element import AnyElement
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import NamedSpec
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.components.resting import resting_of
from steptwin.simulation.describe.blueprint import Blueprint, memory_file
from steptwin.simulation.describe.connected import connected_names
from steptwin.simulation.faults import Faults
from steptwin.simulation.faults.element import FaultyElement
from steptwin.simulation.kinds.kind import ControllerSpec, Member, Terminals
from steptwin.simulation.kinds.links import LineSpec
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.scheduler import Scheduler, TerminalBlock
from steptwin.simulation.scheduler.trace import RecordSink, TraceRecord
from steptwin.simulation.toml.table import TableSpec

Keep = Callable[[str, bytes, Nanos], None]
"""Stores the non-volatile memory of a controller (name, contents, moment); returns when it is on disk. Raises `OSError`."""


def build(blueprint: Blueprint, record: RecordSink, keep: Keep | None = None, *, is_blank: bool = False) -> BuiltObjects:
    """The controllers of a description at time 0. Raises `WorldError` where its parts do not fit together.

    ``keep`` is called whenever a controller has a new non-volatile memory. ``is_blank``: as for `Scheduler`.
    """
    return _Builder(blueprint, record, keep, is_blank=is_blank).objects


OVER = ("of", "when", "rate")
"""Keys over signals of others, which are built before."""


class _Builder:
    def __init__(self, blueprint: Blueprint, record: RecordSink, keep: Keep | None, *, is_blank: bool) -> None:
        self.spec = spec = blueprint.spec
        self.blueprint = blueprint
        self._keep = keep
        self._is_blank = is_blank
        self.objects = BuiltObjects(spec.lines, spec.elements, Faults(spec.seed), record)
        self.objects.faults.sinks.append(record)
        self.context = ElementContext(spec.text, spec.seed, blueprint.memo, self.objects)
        self._make_controllers()
        self._make_schedulers()
        self._make_lines()
        self._make_elements()

    # ------------------------------------------------------------------ controllers

    def _make_controllers(self) -> None:
        for spec in self.spec.controllers:
            if spec.name in self.blueprint.makers:
                self.spec.text.unless_wrong(spec.path, partial(self._add_controller, spec))

    def _add_controller(self, spec: ControllerSpec) -> None:
        memory = self.blueprint.files.get(memory_file(spec.name))
        controller = self.blueprint.makers[spec.name](memory)
        self.objects.controllers[spec.name] = controller
        self.objects.kind_of[spec.name] = spec.kind
        spec.kind.watch_events(controller, partial(_record_event, self.objects.record, spec.name))
        keep = self._keep
        if keep is not None:
            spec.kind.keep_memory(controller, memory, lambda data: keep(spec.name, data, controller.now))

    # ------------------------------------------------------------------ schedulers

    def _make_schedulers(self) -> None:
        """Controllers connected by a line, a wire or mechanics share a scheduler; schedulers are ordered by their first
        controller."""
        memo = self.blueprint.memo
        terminal_blocks = memo.once(
            ("terminal blocks",), lambda: {spec.name: (spec, terminals) for spec, terminals in self._terminal_blocks()}
        )
        if self.blueprint.connected is None:
            self.blueprint.connected = connected_names(self.spec, self.objects.controllers)
        for names in self.blueprint.connected:
            scheduler = Scheduler(record=self.objects.record, is_checked=memo.is_checked, is_blank=self._is_blank)
            self.objects.schedulers.append(scheduler)
            for name in names:
                self.objects.scheduler_of[name] = scheduler
                if name in self.objects.controllers:
                    scheduler.add(name, self.objects.controllers[name])
                elif name in terminal_blocks:
                    spec, terminals = terminal_blocks[name]
                    self._add_terminal_block(spec, terminals, scheduler)

    def _terminal_blocks(self) -> Iterator[tuple[NamedSpec, Terminals]]:
        for element in ELEMENTS.values():
            if element.terminals is not None:
                for spec in element.named(self.spec.elements[element.name]):
                    yield spec, element.terminals(spec)

    def _add_terminal_block(self, spec: NamedSpec, terminals: Terminals, scheduler: Scheduler) -> None:
        # What has none, such as a nest that no cup comes to, needs no controller.
        if terminals != Terminals() and not scheduler.controllers and not self.spec.text.findings:
            self.spec.text.wrong(spec.path, "D009", f"nothing joins {spec.name!r} to a controller")
        self.objects.terminals[spec.name] = terminals
        scheduler.add_terminal_block(
            TerminalBlock(scheduler, spec.name, (*terminals.digital_inputs, *terminals.analog_inputs), terminals.outputs)
        )

    # ------------------------------------------------------------------ lines

    def _make_lines(self) -> None:
        for spec in self.spec.lines:
            self.spec.text.unless_wrong(spec.path, partial(self._line, spec))

    def _line(self, spec: LineSpec) -> None:
        objects, kind = self.objects, line_kinds()[spec.kind]
        members: list[Member] = []
        for described in self.spec.controllers:
            if described.line != spec.name or described.name not in objects.controllers:
                continue
            if described.kind.line is not kind:
                raise Misuse(f"{described.name!r} cannot be on a line of kind {kind.name}")
            controller = objects.controllers[described.name]
            members.append(Member(spec=described, controller=controller, address=described.kind.address(described, controller)))
        if not members and self.spec.text.is_any_wrong(*self.spec.text.controllers):
            self.spec.text.leave_out(spec.name)
            return
        if not members:
            raise Misuse("nothing is on this line")
        scheduler = self.context.scheduler(spec.name)
        line = kind.make(spec, members, scheduler, objects.record, objects.faults)
        scheduler.add_part(line, (spec.name, *(member.spec.name for member in members)), spec.name)
        objects.lines[spec.name] = line
        for member in members:
            objects.line_of[member.spec.name] = line, member.address

    # ------------------------------------------------------------------ elements

    def _make_elements(self) -> None:
        """In the order of `ELEMENTS`, but behind those whose signals they are over, and what those carry (`_waits`)."""
        later: list[tuple[AnyElement, TableSpec]] = []
        for element in ELEMENTS.values():
            specs = self.spec.elements[element.name]
            waiting = [spec for spec in specs if self._waits(element, spec, later)]
            later += [(element, spec) for spec in waiting]
            self._build_elements(element, [spec for spec in specs if all(spec is not one for one in waiting)])
        while later:
            # Where all wait for each other, the first one may do with the terminals of the others, or says so.
            turn = next((turn for turn, one in enumerate(later) if not self._waits(*one, later)), 0)
            element, spec = later.pop(turn)
            self._build_elements(element, [spec])
        if not self.spec.text.findings:
            self._place_elements()
        if not self.spec.text.findings:
            self.context.close_circuits()
            for number, scheduler in enumerate(self.objects.schedulers):
                scheduler.arrange(self.blueprint.memo.once(("order", number), scheduler.order))

    def _place_elements(self) -> None:
        """Give elements their places in space, after all were built."""
        frames, text = self.objects.frames, self.spec.text
        for name in () if self.blueprint.memo.is_checked else frames:
            text.unless_wrong(frames.described[name].path, partial(frames.__getitem__, name))
        add_belts(self.objects)
        for spec in self.spec.elements.of(CONVEYOR):
            if spec.may_drop(self.spec.elements) and not text.findings:
                resting_of(self.context, self.context.scheduler(spec.name))

    def _waits(self, element: AnyElement, spec: TableSpec, later: Iterable[tuple[AnyElement, TableSpec]]) -> bool:
        """Whether it is over a signal of an element that is not built yet, or has to do with what one of ``later`` carries."""
        references = [*element.refers(spec, self.spec.elements)]
        over = (reference.other for reference in references if reference.path[-1] in OVER)
        if any(self.objects.unbuilt(owner) is not None for owner in over):
            return True
        mounts = self.spec.elements.mounts
        moving = {named.name for other, one in later if one is not spec for named in other.named((one,))}
        moving = {name for name in moving if name in mounts and mounts[name].moves_others}
        carried = (name for reference in references for name in (reference.one, reference.other)) if moving else ()
        return any(carrier in moving for name in carried for carrier in self.spec.elements.carriers(name))

    def _build_elements(self, element: AnyElement, specs: Iterable[TableSpec]) -> None:
        built = [(spec, self._element(element, spec)) for spec in specs]
        if element.connect is not None:
            for spec, part in built:
                if part is not None:
                    self.spec.text.unless_wrong(spec.path, partial(element.connect, spec, part, self.context))

    def _element(self, element: AnyElement, spec: TableSpec) -> Any:
        """The built element; None if it has errors."""
        found = self.spec.text.unless_wrong(spec.path, partial(element.build, spec, self.context))
        if found is None:
            return None
        for named in element.named((spec,)):
            self.objects.elements.setdefault(element.name, {})[named.name] = found
            if element.signals is not None:
                self.objects.signals_of[named.name] = partial(element.signals, found)
            if element.moves is not None:
                self.objects.frames.add(named.name, partial(element.moves, named, found))
            if element.faults:
                scheduler = self._scheduler_of(element, named)
                faults, signals = self.objects.faults, partial(element.signals or dict, found)
                failing = FaultyElement(scheduler, named.name, faults, element.faults, found, signals)
                self.objects.faults.elements[named.name] = failing
                scheduler.add_part(failing, ())
        return found

    def _scheduler_of(self, element: AnyElement, spec: NamedSpec) -> Scheduler:
        """The scheduler that an element is in: its own, or that of the first thing it refers to."""
        name = next(iter(element.refers(spec, self.spec.elements))).one if element.terminals is None else spec.name
        return self.context.scheduler(name)


def _record_event(record: RecordSink, controller: str, event: ControllerEvent) -> None:
    record(TraceRecord(event.time, controller, "event", event.code, event.text, event.facts))
