"""Where elements are built: machines and kernels by name, inputs that one thing alone drives, contacts that share one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from steptwin.errors import Misuse, SourceErrors
from steptwin.machine import MotionController
from steptwin.world.chance import Chance
from steptwin.world.contacts import Circuit
from steptwin.world.kernel import Kernel, PinName
from steptwin.world.kind import DIGITAL_INPUT, AnyKind
from steptwin.world.names import Unknown
from steptwin.world.spec import WorldSpec
from steptwin.world.tomlplaces import Path

if TYPE_CHECKING:
    from steptwin.world.parts import WorldParts

Terminal = tuple[str, str]
"""Machine and pin, as a description names them."""


class Site:
    """What an element is given to build itself with. Every method raises `Misuse` for what is not there, or does not fit."""

    def __init__(self, spec: WorldSpec, parts: WorldParts) -> None:
        self.spec = spec
        self.parts = parts
        self._driven: dict[PinName, Path] = {}
        """What drives each input."""
        self._circuits: dict[PinName, tuple[Circuit, str | None]] = {}
        """The contacts of inputs, and their ``join``."""

    def unless_wrong(self, path: Path, action: Callable[[], None]) -> None:
        """Do something for the table at ``path``, unless it has an error already; errors are collected there."""
        if self.spec.text.is_wrong(path):
            return
        try:
            action()
        except SourceErrors as error:
            self.spec.text.wrong_file(path, error)
        except Misuse as error:
            self.spec.text.wrong_reference(path, error)

    # ------------------------------------------------------------------ what is there

    @property
    def machines(self) -> Mapping[str, MotionController]:
        return self.parts.machines

    def machine(self, name: str) -> MotionController:
        """What has pins and axes: no line."""
        found = self.parts.machines.get(name)
        if found is None and name not in self.parts.kernel_of:
            raise Unknown(name, f"nothing is called {name!r}")
        if found is None:
            raise Misuse(f"{name!r} is a line; machines are {', '.join(self.parts.machines)}")
        return found

    def kind(self, name: str) -> AnyKind:
        """Of a machine."""
        self.machine(name)
        return self.parts.kind_of[name]

    def kernel(self, name: str) -> Kernel:
        """Of a machine or a line."""
        found = self.parts.kernel_of.get(name)
        if found is None:
            raise Unknown(name, f"nothing is called {name!r}")
        return found

    # ------------------------------------------------------------------ terminals

    def terminal(self, name: Terminal, kind: str) -> PinName:
        """A terminal of a machine, of one of the kinds of `steptwin.world.kind`."""
        pin = PinName(*name)
        machine, its = self.machine(pin.machine), self.kind(pin.machine)
        its.terminals.check(pin, kind)
        its.refuse_taken(machine, pin.pin)
        return pin

    def input(self, name: Terminal, path: Path, kind: str = DIGITAL_INPUT) -> PinName:
        """An input that nothing else drives."""
        target = PinName(*name)
        if target in self._driven:
            raise Misuse(f"{target} is driven already, from line {self.spec.text.line(self._driven[target])}")
        self.terminal(name, kind)
        self._driven[target] = path
        return target

    def circuit(self, kernel: Kernel, name: Terminal, path: Path, join: str | None) -> Circuit:
        """What a contact is part of: an input of its own, or one that it shares with contacts that are joined in the same way."""
        target = PinName(*name)
        there, their_join = self._circuits.get(target, (None, None))
        if there is None:
            circuit = Circuit(kernel, self.input(name, path), in_series=join == "series")
            self._circuits[target] = circuit, join
            return circuit
        if join is None or join != their_join:
            line = self.spec.text.line(self._driven[target])
            raise Misuse(
                f"{target} is driven already, from line {line}: contacts that share an input all have join = 'parallel', "
                "or all join = 'series'"
            )
        return there

    def bounce_of(self, circuit: Circuit) -> Chance:
        """The chance of the contact that is put into a circuit next."""
        number = f" {len(circuit.contacts) + 1}" if circuit.contacts else ""
        return Chance(self.spec.seed, f"bounce {circuit.target}{number}")

    def close_circuits(self) -> None:
        """Inputs take what their contacts give them at first."""
        for circuit, _ in self._circuits.values():
            circuit.close()
