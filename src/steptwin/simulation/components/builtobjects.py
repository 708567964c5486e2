"""The objects that are built from a description, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from steptwin.motioncontroller import MotionController
from steptwin.simulation.components.elementspec import B, ElementSpecs, ElementTable, NamedSpec, S
from steptwin.simulation.components.frames import Frames
from steptwin.simulation.components.workpieces import Workpieces
from steptwin.simulation.faults import Faults
from steptwin.simulation.kinds.kind import AnyKind, Terminals
from steptwin.simulation.kinds.lines import Line
from steptwin.simulation.kinds.links import LineSpec
from steptwin.simulation.logic.contacts import Circuit
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.toml.keypaths import Path


@dataclass(slots=True)
class BuiltObjects:
    """The objects built from a description."""

    line_specs: Sequence[LineSpec]
    described: ElementSpecs
    """The elements of the description."""
    faults: Faults
    record: RecordSink
    schedulers: list[Scheduler] = field(default_factory=list)
    scheduler_of: dict[str, Scheduler] = field(default_factory=dict)
    """Schedulers of controllers, lines and elements with terminals."""
    controllers: dict[str, MotionController] = field(default_factory=dict)
    kind_of: dict[str, AnyKind] = field(default_factory=dict)
    """Kinds of controllers."""
    lines: dict[str, Line] = field(default_factory=dict)
    line_of: dict[str, tuple[Line, int]] = field(default_factory=dict)
    """Line and unit (or address) of each controller."""
    terminals: dict[str, Terminals] = field(default_factory=dict)
    """Terminals of elements that have some."""
    driven: dict[PinName, Path] = field(default_factory=dict)
    """Place in the description of what drives an input."""
    circuits: dict[PinName, Circuit] = field(default_factory=dict)
    """The contacts of the inputs that have some."""
    frames: Frames = field(init=False)
    """Places in space."""
    workpieces: Workpieces = field(default_factory=Workpieces)
    elements: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Built elements with names: by the name of the kind, then by their own."""
    signals_of: dict[str, Callable[[], Mapping[str, SignalOf]]] = field(default_factory=dict)
    """Signals of built elements with names."""
    supplied: dict[str, str] = field(default_factory=dict)
    """The power supplies of controllers that have one."""

    turned: set[str] = field(default_factory=set)
    """Controllers whose encoders belts and DC motors turn."""

    def __post_init__(self) -> None:
        self.frames = Frames(self.described)

    def built(self, element: ElementTable[S, B]) -> Mapping[str, B]:
        """The built elements of a kind, by name."""
        return cast("Mapping[str, B]", self.elements.get(element.name, {}))

    @property
    def element_names(self) -> list[str]:
        return [name for built in self.elements.values() for name in built]

    def unbuilt(self, name: str) -> str | None:
        """The kind of an element that the description has and that is not built yet."""
        for kind, specs in self.described.items():
            named = any(isinstance(one, NamedSpec) and one.name == name for one in specs)
            if named and name not in self.elements.get(kind, {}):
                return kind
        return None

    def element_signals(self, name: str) -> Mapping[str, SignalOf] | None:
        """The signals of an element; None if no element has the name."""
        signals = self.signals_of.get(name)
        return None if signals is None else signals()
