"""``[[gate]]``: an output that follows one or more inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT, PinOf, Terminal, whole, word

MOST_INPUTS = 32
OUT = "OUT"

FUNCTIONS: Mapping[str, Callable[[list[bool]], bool]] = {
    "and": all,
    "or": any,
    "nand": lambda levels: not all(levels),
    "nor": lambda levels: not any(levels),
    "xor": lambda levels: sum(levels) % 2 == 1,
    "not": lambda levels: not levels[0],
}
"""By ``kind``."""


@dataclass(frozen=True, slots=True)
class GateInputs(PinOf):
    """Outputs that it is connected to, or how many inputs it has."""

    def __call__(self, value: Any) -> int | tuple[Terminal, ...]:
        return whole(1, self.most)(value) if isinstance(value, int) else PinOf.__call__(self, value)


@table("[[gate]]")
class GateSpec(TerminalComponentSpec):
    kind: str = key(word(*FUNCTIONS), ", ".join(FUNCTIONS))
    inputs: int | tuple[Terminal, ...] = key(
        GateInputs(OUTPUT, MOST_INPUTS),
        "outputs connected to IN1, IN2 ...: CONTROLLER.PIN or ELEMENT.TERMINAL; or how many inputs, for wires and contacts",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its inputs."""
        return tuple(f"IN{n + 1}" for n in range(self.inputs if isinstance(self.inputs, int) else len(self.inputs)))

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=self.names, outputs=(OUT,))

    @property
    def joints(self) -> Iterable[Joint]:
        sources = () if isinstance(self.inputs, int) else self.inputs
        return [Joint("inputs", name, source) for name, source in zip(self.names, sources, strict=False)]

    def check(self, text: TomlText) -> None:
        if self.kind == "not" and len(self.names) != 1:
            text.wrong((*self.path, "inputs"), "D007", f"a gate of kind 'not' has one input, not {len(self.names)}")


class Gate(TerminalComponent):
    """Gives its output the level that follows from its inputs, without delay."""

    FIXED: ClassVar[tuple[str, ...]] = ("_function", "_inputs", "kind")
    __slots__ = (*FIXED,)

    def __init__(self, block: TerminalBlock, kind: str, inputs: Iterable[str]) -> None:
        super().__init__(block)
        self.kind = kind
        self._function = FUNCTIONS[kind]
        self._inputs = tuple(inputs)

    def update(self, now: Nanos) -> None:
        self.block.put(OUT, float(self._function([self.block.is_on(name) for name in self._inputs])))


_GATE = with_terminals(
    GateSpec,
    faults=STUCK,
    make=lambda spec, context: Gate(context.terminal_block(spec.name), spec.kind, spec.names),
)
GATE = replace(_GATE, function=lambda gate: gate.kind)
