"""Base of elements with terminals: a terminal block, keys that join outputs of others to it, its levels as signals,
and the faults of terminals that are stuck."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Generic, NamedTuple, TypedDict, TypeVar, Unpack

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.element import Element, Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.mount import Movement
from steptwin.simulation.faults import ActiveFault, Fault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import FaultCategory, Parameter, ParameterForm, whole
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.channels import MovedChannel
from steptwin.simulation.mechanics.drawing import Drawing
from steptwin.simulation.scheduler.scheduledparts import Depends
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import Terminal, name_value
from steptwin.state import Stateful


class Joint(NamedTuple):
    """An output, which the key ``key`` names, connected to an input of the element."""

    key: str
    input: str
    source: Terminal


@table()
class TerminalComponentSpec(NamedSpec, ABC):
    """The table of an element with terminals."""

    name: str = key(name_value, "how others name it", order=-2)

    @property
    @abstractmethod
    def terminals(self) -> Terminals:
        """Its inputs and outputs."""

    @property
    @abstractmethod
    def joints(self) -> Iterable[Joint]:
        """Outputs that its keys join to its inputs."""

    def others(self, described: ElementSpecs) -> Iterable[tuple[str, str]]:
        """Keys that name other elements, and the names of these or of what they are in one scheduler with."""
        return ()


class TerminalComponent(Stateful, ABC):
    """A component with terminals: gives the outputs of its terminal block their levels."""

    __slots__ = ("block",)

    def __init__(self, block: TerminalBlock) -> None:
        self.block = block

    @property
    def depends_on(self) -> Depends:
        """The controllers and elements whose changes concern it."""
        return (self.block.name,)

    @property
    def reads(self) -> tuple[str, ...]:
        """The controllers and elements whose signals it reads."""
        return ()

    @property
    def delays(self) -> tuple[Nanos, ...]:
        """How much later than an input an output may change."""
        return ()

    @abstractmethod
    def update(self, now: Nanos) -> None:
        """As `ScheduledPart.update`."""

    def deadline(self) -> Nanos | None:
        """As `ScheduledPart.deadline`; none for an element whose outputs follow its inputs alone."""
        return None


S = TypeVar("S", bound=TerminalComponentSpec)
P = TypeVar("P", bound=TerminalComponent)


def _wires(spec: TerminalComponentSpec) -> Iterator[tuple[Wire, Path]]:
    """To its inputs, with the keys that name their sources."""
    for joint in spec.joints:
        yield Wire(PinName(*joint.source), PinName(spec.name, joint.input)), (*spec.path, joint.key)


# ---------------------------------------------------------------------- faults


def _check_terminal(component: TerminalComponent, fault: Fault, key: str, permitted: tuple[str, ...]) -> None:
    block, given = component.block, str(fault.get(key))
    if given.upper() not in permitted:
        there = ", ".join(name.lower() for name in permitted) or "none"
        raise Misuse(f"fault {fault.kind.name}: {key} = {given!r}: {key}s of {block.name!r} are {there}")


def _check_output(component: TerminalComponent, fault: Fault) -> None:
    _check_terminal(component, fault, "output", component.block.outputs)


def _check_input(component: TerminalComponent, fault: Fault) -> None:
    _check_terminal(component, fault, "input", component.block.inputs)


IS_STUCK_AT = Message("simulation.is-stuck-at", "{name} is stuck at {level}")
TERMINAL_IS_FREE = Message("simulation.terminal-is-free", "{name} is free again")


def _stick(active: ActiveFault, component: TerminalComponent, begins: bool, now: Nanos) -> str:
    terminal, level = str(active.fault.get("output") or active.fault.get("input")), active.fault.whole("level") or 0
    component.block.hold(terminal.upper(), float(level) if begins else None)
    name = f"{component.block.name}.{terminal.lower()}"
    return IS_STUCK_AT(name=name, level=level) if begins else TERMINAL_IS_FREE(name=name)


def _is_stuck(active: ActiveFault, component: TerminalComponent, now: Nanos) -> bool:
    return component.block.is_altered(str(active.fault.get("output") or active.fault.get("input")).upper())


STUCK_OUTPUT = FaultKind(
    "stuck-output",
    Layer.ELEMENT,
    Occasion.ALWAYS,
    "An output of an element keeps its level.",
    own=(
        Parameter("output", ParameterForm.TEXT, "Which output.", default="out"),
        whole("level", "The level it keeps.", 0, 1, default=0),
    ),
    effect=ElementEffect(_stick, _is_stuck, holds="output"),
    check=_check_output,
    tried=({"level": 0}, {"level": 1}),
)
"""For elements with outputs."""
STUCK_INPUT = FaultKind(
    "stuck-input",
    Layer.ELEMENT,
    Occasion.ALWAYS,
    "An input of an element keeps a level, whatever its contacts or its wire do.",
    own=(
        Parameter("input", ParameterForm.TEXT, "Which input.", is_required=True),
        whole("level", "The level it keeps.", 0, 1, default=0),
    ),
    effect=ElementEffect(_stick, _is_stuck, holds="input"),
    check=_check_input,
    faulty=FaultCategory.SENSOR,
    tried=({"level": 0}, {"level": 1}),
)
"""For elements with inputs."""
STUCK = (STUCK_OUTPUT, STUCK_INPUT)
"""For elements with both."""


# ---------------------------------------------------------------------- an element


class _Rest(TypedDict, Generic[S, P], total=False):
    """As in `Element`."""

    connect: Callable[[S, P, ElementContext], None]
    drawing: Callable[[P], Drawing]
    moved: Callable[[P], Iterable[tuple[str, MovedChannel]]]
    moves: Callable[[S, P], Sequence[Movement]]
    stands: Callable[[P, Nanos], Stands | None]


def with_terminals(
    spec: type[S],
    *,
    make: Callable[[S, ElementContext], P],
    signals: Callable[[P], Mapping[str, SignalOf]] = lambda component: {},
    faults: Sequence[FaultKind] = (),
    refers: Callable[[S], Iterable[Reference]] = lambda spec: (),
    fit: Callable[[S, P, ElementContext], None] = lambda spec, component, context: None,
    **rest: Unpack[_Rest[S, P]],
) -> Element[S, P]:
    """An element with a name and terminals. Each terminal is a signal, each output a channel.

    ``signals`` and ``refers`` are those besides. ``fit`` adds the parts of tables in its table.
    """

    def all_references(found: S, described: ElementSpecs) -> Iterator[Reference]:
        yield from _references(found, described)
        yield from refers(found)

    def build(found: S, context: ElementContext) -> P:
        component = make(found, context)
        component.block.scheduler.add_part(component, component.depends_on, found.name, reads=component.reads)
        for wire, path in context.memo.once((*found.path, "wires"), lambda: tuple(_wires(found))):
            context.join(wire, path)
        fit(found, component, context)
        return component

    return Element(
        spec=spec,
        refers=all_references,
        build=build,
        terminals=lambda found: found.terminals,
        signals=lambda component: {**_terminal_signals(component.block), **signals(component)},
        faults=tuple(faults),
        **rest,
    )


def _references(found: TerminalComponentSpec, described: ElementSpecs) -> Iterator[Reference]:
    """References of the terminals and keys of an element."""
    yield Reference(found.name, found.name, found.path)
    for joint in found.joints:
        yield Reference(found.name, joint.source[0], (*found.path, joint.key))
    for name, other in found.others(described):
        yield Reference(found.name, other, (*found.path, name))


def _terminal_signals(block: TerminalBlock) -> Mapping[str, SignalOf]:
    return {terminal.lower(): level_signal(block, terminal) for terminal in block.levels}


def level_signal(block: TerminalBlock, terminal: str) -> SignalOf:
    return SignalOf((block.source,), partial(_level, block, terminal))


def _level(block: TerminalBlock, terminal: str, now: Nanos) -> float:
    return block.levels[terminal]
