"""The context in which elements are built: controllers and schedulers by name, inputs and their drivers, shared contacts."""

from __future__ import annotations

from steptwin.errors import Misuse
from steptwin.motioncontroller import MotionController
from steptwin.simulation.components.buildmemo import BuildMemo
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.frames import Frames
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.simulation.logic.contacts import Circuit
from steptwin.simulation.scheduler.chance import Chance
from steptwin.simulation.scheduler.scheduler import Scheduler, TerminalBlock
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.names import Unknown
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.values import DIGITAL_INPUT, OUTPUT, Terminal


class ElementContext:
    """The context for building an element. Every method raises `Misuse` for a name that does not exist or does not fit."""

    def __init__(self, text: TomlText, seed: int, memo: BuildMemo, objects: BuiltObjects) -> None:
        """``text``: the description; ``seed``: that of the world."""
        self.text = text
        self.memo = memo
        self.objects = objects
        self._seed = seed
        self._joins: dict[PinName, str | None] = {}
        """``join`` of each input with contacts."""

    @property
    def frames(self) -> Frames:
        """All elements with a place in space, once every element is built."""
        return self.objects.frames

    # ------------------------------------------------------------------ controllers and schedulers

    def controller(self, name: str) -> MotionController:
        """The controller called ``name``, which is not a line."""
        found = self.objects.controllers.get(name)
        if found is None and name not in self.objects.scheduler_of:
            raise Unknown(name, f"nothing is called {name!r}")
        if found is None:
            what = "an element" if name in self.objects.terminals else "a line"
            raise Misuse(f"{name!r} is {what}; controllers are {', '.join(self.objects.controllers)}")
        return found

    def kind(self, name: str) -> AnyKind:
        """The kind of a controller."""
        self.controller(name)
        return self.objects.kind_of[name]

    def scheduler(self, name: str) -> Scheduler:
        """The scheduler of a controller, a line or an element with terminals."""
        found = self.objects.scheduler_of.get(name)
        if found is None:
            raise Unknown(name, f"nothing is called {name!r}")
        return found

    # ------------------------------------------------------------------ terminals

    def terminal_block(self, name: str) -> TerminalBlock:
        """The terminals of the element ``name``."""
        return self.scheduler(name).terminal_blocks[name]

    def join(self, wire: Wire, path: Path) -> None:
        """Join an output to an input that nothing else drives. ``path``: the table of the wire, or the key of its source."""
        scheduler = self.scheduler(wire.source.controller)
        if self.memo.is_checked:
            self.objects.driven[wire.target] = path
        else:
            self.terminal(wire.source, OUTPUT)
            self.input(wire.target, path)
        scheduler.connect(wire)

    def terminal(self, name: Terminal, kind: str) -> PinName:
        """A terminal of a controller or an element; ``kind`` is one of those of `steptwin.simulation.toml.values`."""
        pin = PinName(*name)
        if self.memo.is_checked:
            return pin
        of_element = self.objects.terminals.get(pin.controller)
        if of_element is not None:
            of_element.check(pin, kind)
            return pin
        controller, its = self.controller(pin.controller), self.kind(pin.controller)
        its.terminals.check(pin, kind)
        its.refuse_taken(controller, pin.pin)
        return pin

    def input(self, name: Terminal, path: Path, kind: str = DIGITAL_INPUT) -> PinName:
        """An input, reserved for one driver."""
        target = PinName(*name)
        if target in self.objects.driven and not self.memo.is_checked:
            raise Misuse(f"{target} is driven already, from {self.text.where(self.objects.driven[target])}")
        self.terminal(name, kind)
        self.objects.driven[target] = path
        return target

    def circuit(self, scheduler: Scheduler, name: Terminal, path: Path, join: str | None) -> Circuit:
        """The circuit of a contact: an input of its own, or one shared with contacts that have the same ``join``."""
        target = PinName(*name)
        there = self.objects.circuits.get(target)
        if there is None:
            circuit = Circuit(scheduler, self.input(name, path), in_series=join == "series")
            self.objects.circuits[target], self._joins[target] = circuit, join
            return circuit
        if join is None or join != self._joins[target]:
            where = self.text.where(self.objects.driven[target])
            raise Misuse(
                f"{target} is driven already, from {where}: contacts that share an input all have join = 'parallel', "
                "or all join = 'series'"
            )
        return there

    def bounce_of(self, circuit: Circuit) -> Chance:
        """The random stream for the bounce of the next contact in a circuit."""
        number = f" {len(circuit.contacts) + 1}" if circuit.contacts else ""
        return Chance(self._seed, f"bounce {circuit.target}{number}")

    def close_circuits(self) -> None:
        """Drive all inputs with contacts to their initial levels."""
        for circuit in self.objects.circuits.values():
            circuit.close()
