"""Effects of faults: what each occasion of a fault calls."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.faults.active import ActiveFault, FaultReporter
from steptwin.simulation.faults.answers import AlteredAnswer, Exchange
from steptwin.simulation.faults.controller import FaultyController
from steptwin.simulation.faults.table import Fault, FaultKind, Layer, Occasion, check
from steptwin.tables import IncompleteTable


class Run:
    """The received pieces, each with its additional delay."""

    def __init__(self) -> None:
        self.pieces: list[tuple[Nanos, bytearray]] = [(0, bytearray())]

    def put(self, data: Iterable[int]) -> None:
        self.pieces[-1][1].extend(data)

    def pause(self, time: Nanos) -> None:
        self.pieces.append((self.pieces[-1][0] + time, bytearray()))


@dataclass(frozen=True, slots=True)
class ByteEffect:
    """``act`` gives what arrives of a byte, None where it is lost; bytes before it are put into the run."""

    act: Callable[[ActiveFault, int, Run, FaultReporter], int | None]


@dataclass(frozen=True, slots=True)
class InsertEffect:
    """``act`` puts bytes into the run before those of a delivery."""

    act: Callable[[ActiveFault, Run, FaultReporter], None]


@dataclass(frozen=True, slots=True)
class SplitEffect:
    """``act`` gives the pieces in which a run arrives, each with its delay; takes the run and the length of the delivery. Only
    one such fault happens to a delivery, the first."""

    act: Callable[[ActiveFault, Run, int, FaultReporter], list[tuple[Nanos, bytes]]]


@dataclass(frozen=True, slots=True)
class AnswerEffect:
    """``answer`` gives what is sent of an answer; without bytes later faults have nothing to happen to."""

    answer: Callable[[ActiveFault, Exchange, int, AlteredAnswer, FaultReporter], AlteredAnswer]


@dataclass(frozen=True, slots=True)
class RequestEffect:
    """``refusal`` gives the exception code and the text for a request that is not carried out. ``is_refused``: whether this one
    is not; else it is carried out, and ``answer`` gives what is sent, as in `AnswerEffect`."""

    refusal: Callable[[ActiveFault], tuple[int, str]]
    is_refused: Callable[[Fault], bool] | None = None
    answer: Callable[[ActiveFault, Exchange, int, AlteredAnswer, FaultReporter], AlteredAnswer] | None = None


@dataclass(frozen=True, slots=True)
class MomentEffect:
    """``lasts``: it acts while it lasts, which `FaultyController` notes; others act at their moment."""

    act: Callable[[ActiveFault, FaultyController, Nanos], None]
    lasts: bool = False


@dataclass(frozen=True, slots=True)
class WindowEffect:
    """``act`` is called at the beginning and at the end; what it calls notes when it makes a difference (`Faults.does`)."""

    act: Callable[[ActiveFault, FaultyController, Nanos], None]


@dataclass(frozen=True, slots=True)
class ChangeEffect:
    """``act`` takes the pin and its levels, before and after."""

    act: Callable[[ActiveFault, FaultyController, str, tuple[float, float], Nanos], None]


@dataclass(frozen=True, slots=True)
class SaveEffect:
    """``act`` takes what the memory held and changes what it keeps."""

    act: Callable[[ActiveFault, FaultyController, bytes, bytearray, Nanos], None]


@dataclass(frozen=True, slots=True)
class ElementEffect:
    """``act`` takes what was built of the element, and whether the fault begins or ends; gives what it did, in words."""

    act: Callable[[ActiveFault, Any, bool, Nanos], str]
    acts: Callable[[ActiveFault, Any, Nanos], object]
    """Takes what was built, and gives what the fault does there at the moment, while it lasts; false if the element would be the
    same without it. It acts again when that changes."""
    holds: str = ""
    """The parameter with the terminal that it holds at its ``level``; empty: none."""


_FITTING: dict[Occasion, tuple[tuple[Layer, ...], tuple[type, ...]]] = {
    Occasion.BYTE: ((Layer.BYTES,), (ByteEffect,)),
    Occasion.DELIVERY: ((Layer.BYTES,), (InsertEffect, SplitEffect)),
    Occasion.ANSWER: ((Layer.FRAMES,), (AnswerEffect,)),
    Occasion.REQUEST: ((Layer.FRAMES, Layer.PROTOCOL), (RequestEffect,)),
    Occasion.MOMENT: ((Layer.PHYSICS,), (MomentEffect,)),
    Occasion.CHANGE: ((Layer.PHYSICS,), (ChangeEffect,)),
    Occasion.SAVE: ((Layer.PHYSICS,), (SaveEffect,)),
    Occasion.ALWAYS: ((Layer.PHYSICS, Layer.ELEMENT), (WindowEffect, ElementEffect)),
}
"""The layers that have an occasion, and the effects of which one is needed there."""


def checked(kinds: Sequence[FaultKind]) -> dict[str, FaultKind]:
    """The table by name. `Misuse` for a name or parameter given twice, and for a default that is not permitted;
    `IncompleteTable` for a kind without the effect that its occasion needs."""
    table: dict[str, FaultKind] = {}
    for kind in kinds:
        if kind.name in table:
            raise Misuse(f"two kinds of fault are named {kind.name!r}")
        table[kind.name] = kind
        names = [parameter.name for parameter in kind.parameters]
        if len(set(names)) < len(names) or {"kind", "name"} & set(names):
            raise Misuse(f"fault {kind.name}: a parameter is given twice: {', '.join(names)}")
        if bool(kind.lines) == (kind.layer in (Layer.PHYSICS, Layer.ELEMENT)):
            raise Misuse(f"fault {kind.name}: lines belong to all faults but those of physics and elements")
        _check_effect(kind)
        for parameter in kind.parameters:
            where = f"fault {kind.name}, parameter {parameter.name}"
            if (parameter.default is None) == (not parameter.otherwise and not parameter.is_required):
                raise Misuse(f"{where}: a default, what holds otherwise, or required")
            if parameter.default is not None:
                check(parameter, parameter.default, where)
    return table


def _check_effect(kind: FaultKind) -> None:
    layers, effects = _FITTING[kind.occasion]
    if kind.occasion is Occasion.ALWAYS:
        effects = (ElementEffect,) if kind.layer is Layer.ELEMENT else (WindowEffect,)
    fits = isinstance(kind.effect, effects)
    needed = " or ".join(effect.__name__ for effect in effects)
    if kind.layer not in layers:
        raise IncompleteTable(f"fault {kind.name}: nothing of layer {kind.layer} waits for the occasion {kind.occasion}")
    if kind.effect is None:
        raise IncompleteTable(f"fault {kind.name} lacks its effect: {needed}")
    if not fits:
        raise IncompleteTable(f"fault {kind.name} needs the effect {needed}, not {type(kind.effect).__name__}")
    if kind.layer is Layer.FRAMES and kind.effect.answer is None:
        raise IncompleteTable(f"fault {kind.name} lacks what it does to answers")
