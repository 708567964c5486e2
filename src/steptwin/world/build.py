"""Builds machines and kernels from a description: one kernel for all that is connected by wires, lines and mechanics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

from steptwin.diagnostics import Diagnostic, Severity, SourceText, render
from steptwin.errors import Misuse, SourceErrors
from steptwin.machine import MachineEvent, Nanos
from steptwin.world.board import Board
from steptwin.world.element import AnyElement, ElementSpec, NamedSpec, Reference
from steptwin.world.elements import ELEMENTS
from steptwin.world.faults import Faults
from steptwin.world.faults.element import FaultyElement
from steptwin.world.kernel import Kernel
from steptwin.world.kind import Member, Terminals
from steptwin.world.kinds import line_kinds
from steptwin.world.parts import WorldParts
from steptwin.world.pieces import beside
from steptwin.world.site import Site
from steptwin.world.spec import ControllerSpec, LineSpec, WorldSpec
from steptwin.world.trace import Recorder, TraceRecord

Files = Mapping[str, bytes]
"""Contents of the files a description names, and of non-volatile memories (`memory_file`)."""
Keep = Callable[[str, bytes, Nanos], None]
"""Stores the non-volatile memory of a controller (name, contents, moment); returns when it is on disk. Raises `OSError`."""


def memory_file(name: str) -> str:
    """The name, among the files of a world, of the initial non-volatile memory of a controller."""
    return f"state:{name}"


def build(spec: WorldSpec, files: Files, record: Recorder, keep: Keep | None = None) -> WorldParts:
    """The machines of a description at time 0. Raises `WorldError` where its parts do not fit together.

    ``keep`` is called whenever a controller has a new non-volatile memory.
    """
    return _Builder(spec, files, record, keep).parts


class _Builder:
    def __init__(self, spec: WorldSpec, files: Files, record: Recorder, keep: Keep | None) -> None:
        self.spec = spec
        self.files = files
        self._keep = keep
        self.parts = WorldParts(spec, Faults(spec.seed), record)
        self.parts.faults.sinks.append(record)
        self.site = Site(spec, self.parts)
        self._make_machines()
        self._make_kernels()
        self._make_lines()
        self._make_elements()

    # ------------------------------------------------------------------ machines

    def _make_machines(self) -> None:
        for spec in self.spec.controllers:
            self.site.unless_wrong(spec.path, partial(self._add_machine, spec))

    def _add_machine(self, spec: ControllerSpec) -> None:
        memory = self.files.get(memory_file(spec.name))
        machine = spec.kind.build(spec, memory, self)
        self.parts.machines[spec.name] = machine
        self.parts.kind_of[spec.name] = spec.kind
        spec.kind.watch_events(machine, partial(_record_event, self.parts.record, spec.name))
        keep = self._keep
        if keep is not None:
            spec.kind.keep_memory(machine, memory, lambda data: keep(spec.name, data, machine.now))

    def data(self, name: str) -> bytes:
        """As `BuildContext.data`."""
        found = self.files.get(name)
        if found is None:
            raise Misuse(f"the content of the file {name!r} is not given with the description")
        return found

    def accept(self, source: SourceText, findings: Iterable[Diagnostic]) -> None:
        """As `BuildContext.accept`."""
        shown = SourceText(beside(self.spec.text.source.name, source.name), source.text)
        found = tuple(findings)
        if errors := [one for one in found if one.severity is Severity.ERROR]:
            raise SourceErrors(render(shown, errors))
        warnings = [one for one in found if one.severity is Severity.WARNING]
        if warnings and (text := render(shown, warnings)) not in self.parts.warnings:
            self.parts.warnings.append(text)

    # ------------------------------------------------------------------ kernels

    def _make_kernels(self) -> None:
        """Machines connected by a line, a wire or mechanics share a kernel; kernels are ordered by their first machine."""
        boards = {spec.name: (spec, terminals) for spec, terminals in self._boards()}
        joined = {name: name for name in [*self.parts.machines, *(line.name for line in self.spec.lines), *boards]}

        def root(name: str) -> str:
            while joined[name] != name:
                joined[name] = joined[joined[name]]
                name = joined[name]
            return name

        order = {name: i for i, name in enumerate(joined)}
        named = {*joined, *(one.name for element in ELEMENTS.values() for one in element.named(self.spec.elements[element.name]))}
        placed = self._placed()
        for reference in self._joints():
            path = reference.path
            one, other = (placed.get(name, name) for name in reference[:2])
            unknown = [name for name in dict.fromkeys((one, other)) if name not in joined]
            for name in unknown:
                if not self.spec.text.may_be_broken(name):
                    near = self.spec.text.near(name, named)
                    there = ", ".join(joined) or "none"
                    fix = self.spec.text.replacement(path, name, self.spec.text.meant(name, named))
                    self.spec.text.wrong(path, "D009", f"nothing is called {name!r}{near}", f"there are {there}", fix)
            if unknown:
                continue
            first, second = sorted((root(one), root(other)), key=order.__getitem__)
            joined[second] = first
        for name in joined:
            kernel = self.parts.kernel_of.get(root(name))
            if kernel is None:
                kernel = Kernel(record=self.parts.record)
                self.parts.kernels.append(kernel)
            self.parts.kernel_of[root(name)] = self.parts.kernel_of[name] = kernel
            if name in self.parts.machines:
                kernel.add(name, self.parts.machines[name])
            elif name in boards:
                spec, terminals = boards[name]
                self._add_board(spec, terminals, kernel)

    def _boards(self) -> Iterator[tuple[NamedSpec, Terminals]]:
        for element in ELEMENTS.values():
            if element.terminals is not None:
                for spec in element.named(self.spec.elements[element.name]):
                    yield spec, element.terminals(spec)

    def _placed(self) -> Mapping[str, str]:
        """For each element without terminals of its own the first thing that it refers to, in whose kernel it is."""
        return {
            one.name: next(iter(element.refers(one, self.spec))).one
            for element in ELEMENTS.values()
            if element.terminals is None
            for one in element.named(self.spec.elements[element.name])
        }

    def _add_board(self, spec: NamedSpec, terminals: Terminals, kernel: Kernel) -> None:
        if not kernel.machines and not self.spec.text.findings:
            self.spec.text.wrong(spec.path, "D009", f"nothing joins {spec.name!r} to a controller")
        self.parts.terminals[spec.name] = terminals
        kernel.add_board(Board(kernel, spec.name, (*terminals.digital_inputs, *terminals.analog_inputs), terminals.outputs))

    def _joints(self) -> Iterator[Reference]:
        spec = self.spec
        for controller in spec.controllers:
            if controller.line is not None:
                yield Reference(controller.name, controller.line, (*controller.path, "line"))
        for element in ELEMENTS.values():
            for one in spec.elements[element.name]:
                yield from element.refers(one, spec)

    # ------------------------------------------------------------------ lines

    def _make_lines(self) -> None:
        for spec in self.spec.lines:
            self.site.unless_wrong(spec.path, partial(self._line, spec))

    def _line(self, spec: LineSpec) -> None:
        parts, kind = self.parts, line_kinds()[spec.kind]
        members: list[Member] = []
        for controller in self.spec.controllers:
            if controller.line != spec.name or controller.name not in parts.machines:
                continue
            if controller.kind.line is not kind:
                raise Misuse(f"{controller.name!r} cannot be on a line of kind {kind.name}")
            machine = parts.machines[controller.name]
            members.append(Member(spec=controller, machine=machine, address=controller.kind.address(controller, machine)))
        if not members and self.spec.text.is_any_wrong(*self.spec.text.controllers):
            self.spec.text.leave_out(spec.name)
            return
        if not members:
            raise Misuse("nothing is on this line")
        kernel = self.site.kernel(spec.name)
        line = kind.make(spec, members, kernel, parts.record, parts.faults)
        kernel.add_part(line, (spec.name, *(member.spec.name for member in members)), spec.name)
        parts.lines[spec.name] = line
        for member in members:
            parts.line_of[member.spec.name] = line, member.address

    # ------------------------------------------------------------------ elements

    def _make_elements(self) -> None:
        for element in ELEMENTS.values():
            built = [(spec, self._element(element, spec)) for spec in self.spec.elements[element.name]]
            if element.connect is not None:
                for spec, part in built:
                    if part is not None:
                        self.site.unless_wrong(spec.path, partial(element.connect, spec, part, self.site))
        if not self.spec.text.findings:
            self.site.close_circuits()

    def _element(self, element: AnyElement, spec: ElementSpec) -> Any:
        """The built element; None if it has errors."""
        found: list[Any] = []
        self.site.unless_wrong(spec.path, lambda: found.append(element.build(spec, self.site)))
        if not found:
            return None
        for named in element.named((spec,)):
            self.parts.elements.setdefault(element.name, {})[named.name] = found[0]
            if element.faults:
                kernel = self.site.kernel_of(element, named)
                failing = FaultyElement(kernel, named.name, self.parts.faults, element.faults, found[0])
                self.parts.faults.elements[named.name] = failing
                kernel.add_part(failing, ())
        return found[0]


def _record_event(record: Recorder, machine: str, event: MachineEvent) -> None:
    record(TraceRecord(event.time, machine, "event", event.code, event.text, event.facts))
