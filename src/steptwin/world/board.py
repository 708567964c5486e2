"""Terminals of an element: levels by name, which wires, contacts and other elements join as they join pins of controllers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, ClassVar

from steptwin.machine import Nanos
from steptwin.state import Stateful

if TYPE_CHECKING:
    from steptwin.world.kernel import Kernel, Source


class Board(Stateful):
    """The terminals of the element ``name``. All levels are 0 until something drives them.

    Its element reads inputs in `KernelPart.update`, never earlier, so that a loop of elements is found by the kernel.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("inputs", "kernel", "name", "outputs")
    __slots__ = (*FIXED, "_held", "_recorded", "_wanted", "levels")

    def __init__(self, kernel: Kernel, name: str, inputs: Iterable[str], outputs: Iterable[str]) -> None:
        self.kernel = kernel
        self.name = name
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.levels: dict[str, float] = dict.fromkeys((*self.inputs, *self.outputs), 0.0)
        self._wanted: dict[str, float] = {}
        """What the element gives its outputs, and its inputs are driven to."""
        self._held: dict[str, float] = {}
        """Terminals that faults hold."""
        self._recorded: tuple[str, ...] = ()
        """Outputs whose first level has been recorded."""

    @property
    def source(self) -> Source:
        """What its levels, and the signals of its element, depend on."""
        return self.kernel.source(self.name)

    def set_pin(self, pin: str, level: float, now: Nanos) -> None:
        """Drive an input. The element sees it when signals settle."""
        self._wanted[pin] = level
        self.levels[pin] = self._held.get(pin, level)

    def is_on(self, terminal: str) -> bool:
        return self.levels[terminal] != 0.0

    def put(self, output: str, level: float) -> None:
        """Give an output a level now; its first level and every change are recorded and carried along wires."""
        self._wanted[output] = level
        self._show(output, self._held.get(output, level))

    def hold(self, terminal: str, level: float | None) -> None:
        """Hold a terminal at a level, whatever its element gives it, or drives it; None lets it go."""
        if level is None:
            self._held.pop(terminal, None)
        else:
            self._held[terminal] = level
        shown = self._held.get(terminal, self._wanted.get(terminal, 0.0))
        if terminal in self.outputs:
            self._show(terminal, shown)
        else:
            self.levels[terminal] = shown

    def _show(self, output: str, level: float) -> None:
        if level == self.levels[output] and output in self._recorded:
            return
        self.levels[output] = level
        if output not in self._recorded:
            self._recorded = (*self._recorded, output)
        self.kernel.put(self.name, output, level)
