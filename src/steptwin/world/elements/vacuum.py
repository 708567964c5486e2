"""``[[vacuum]]``: a suction cup with its ejector and its vacuum switch, which picks workpieces up and puts them down."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import ceil
from typing import ClassVar

from steptwin.machine import MILLISECOND, Nanos
from steptwin.motion.exponential import decay, logarithm
from steptwin.world.belt import Workpiece, next_change
from steptwin.world.board import Board
from steptwin.world.elements.conveyor import Conveyor, find_conveyor
from steptwin.world.elements.logic import STUCK_OUTPUT, BoardPart, BoardSpec, Joint, with_terminals
from steptwin.world.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.world.faults.table import ElementEffect
from steptwin.world.kind import Terminals
from steptwin.world.reader import TomlText, optional
from steptwin.world.signals import SignalOf
from steptwin.world.site import Site, Terminal
from steptwin.world.spec import WorldSpec
from steptwin.world.values import OUTPUT_PIN, NameOf, number, positive_time

EJECTOR, PICK, PLACE, HELD = "EJECTOR", "PICK", "PLACE", "HELD"


@dataclass(frozen=True, slots=True, kw_only=True)
class VacuumSpec(BoardSpec):
    ejector: Terminal | None
    pick: Terminal | None
    place: Terminal | None
    source: str | None
    pick_at: float
    onto: str | None
    place_at: float
    vacuum: float
    threshold: float
    build_up: Nanos
    release: Nanos

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(EJECTOR, PICK, PLACE), outputs=(HELD,))

    @property
    def joints(self) -> Iterable[Joint]:
        for key, terminal, source in (
            ("ejector", EJECTOR, self.ejector),
            ("pick", PICK, self.pick),
            ("place", PLACE, self.place),
        ):
            if source is not None:
                yield Joint(key, terminal, source)

    def others(self, world: WorldSpec) -> Iterable[tuple[str, str]]:
        if self.source is not None:
            yield "from", self.source
        if self.onto is not None:
            yield "onto", self.onto

    def check(self, text: TomlText) -> None:
        if self.threshold >= self.vacuum:
            text.wrong(
                (*self.path, "threshold"),
                "D007",
                f"threshold = {self.threshold:g} kPa is not below vacuum = {self.vacuum:g} kPa: nothing would ever be held",
            )


class Vacuum(BoardPart):
    """The pressure in the cup, below that of the air, goes exponentially to ``vacuum`` while the ejector is on and a workpiece
    closes the cup, else to 0. From 0 it takes ``build_up`` to the threshold, from ``vacuum`` it takes ``release``. HELD is on
    from the threshold on.

    A workpiece is in the cup while it is held. Then it lies on the belt below, or has fallen.
    """

    __slots__ = (
        "_begin",
        "_due",
        "_first",
        "_goal",
        "_is_held",
        "_pick_at",
        "carried",
        "dropped",
        "leaks",
        "onto",
        "source",
        "spec",
    )
    FIXED: ClassVar[frozenset[str]] = frozenset({"_pick_at", "onto", "source", "spec"}) | BoardPart.FIXED

    def __init__(self, board: Board, spec: VacuumSpec, source: Conveyor | None, onto: Conveyor | None) -> None:
        super().__init__(board)
        self.spec = spec
        self.source = source
        self._pick_at = 0 if source is None else source.places(spec.pick_at)
        self.onto = onto
        self.carried: Workpiece | None = None
        """The workpiece in the cup, as it was on the belt it was taken from."""
        self.dropped = 0
        """How many have fallen."""
        self.leaks = False
        self._is_held = False
        self._begin: Nanos = board.kernel.now
        self._first = 0.0
        """Pressure at `_begin`, kPa below that of the air."""
        self._goal = 0.0
        self._due: Nanos | None = None
        """When the pressure comes to the threshold."""

    # ------------------------------------------------------------------ pressure

    def pressure(self, now: Nanos) -> float:
        """kPa below that of the air."""
        time = self._time(self._goal > 0.0)
        return self._goal + (self._first - self._goal) * decay((now - self._begin) / time)

    @property
    def version(self) -> object:
        """Another value whenever the pressure goes another way."""
        return self._begin, self._goal

    def _time(self, is_evacuating: bool) -> float:
        """The time constant, ns."""
        spec = self.spec
        if is_evacuating:
            return spec.build_up / logarithm(spec.vacuum / (spec.vacuum - spec.threshold))
        return spec.release / logarithm(spec.vacuum / spec.threshold)

    def _go(self, goal: float, now: Nanos) -> None:
        """Let the pressure go to another value."""
        self._first, self._begin, self._goal = self.pressure(now), now, goal
        threshold = self.spec.threshold
        self._due = None
        if (goal > threshold) is not self._is_held:
            ratio = (self._first - goal) / (threshold - goal)
            self._due = now if ratio <= 1.0 else now + ceil(logarithm(ratio) * self._time(goal > 0.0))

    # ------------------------------------------------------------------ time

    @property
    def watches(self) -> tuple[str, ...]:
        return (self.board.name, *(() if self.source is None else (self.source.board.name,)))

    def update(self, now: Nanos) -> None:
        goal = self.spec.vacuum if self.board.is_on(EJECTOR) and self._is_closed(now) and not self.leaks else 0.0
        if goal != self._goal:
            self._go(goal, now)
        if self._due is not None and self._due <= now:
            self._due = None
            self._is_held = not self._is_held
            if self._is_held:
                self._pick(now)
            else:
                self._let_go(now)
        self.board.put(HELD, float(self._is_held))

    def _is_closed(self, now: Nanos) -> bool:
        """Whether a workpiece closes the cup."""
        return self.carried is not None or self._below(now) is not None

    def _below(self, now: Nanos) -> Workpiece | None:
        """The workpiece under the cup. Without a conveyor there is one wherever PICK is on."""
        if not self.board.is_on(PICK):
            return None
        source = self.source
        if source is None:
            return Workpiece("workpiece", 0, 0)
        return source.load.covering(self._pick_at, source.drive.place(now))

    def _pick(self, now: Nanos) -> None:
        piece = self._below(now)
        if self.carried is None and piece is not None:
            self.carried = piece
            if self.source is not None:
                self.source.take(piece)
                self.source.report(f"{self.board.name} holds {piece.name}", piece.name, "held")

    def _let_go(self, now: Nanos) -> None:
        piece, self.carried = self.carried, None
        source, onto = self.source, self.onto
        if piece is None or source is None:
            return
        if onto is not None and self.board.is_on(PLACE):
            onto.put(piece.name, self.spec.place_at, onto.places_of(source, piece.length), now)
        elif self.board.is_on(PICK):
            source.put(piece.name, self.spec.pick_at, piece.length, now)
        else:
            self.dropped += 1
            source.report(f"{piece.name} falls from {self.board.name}", piece.name, "falls")

    def deadline(self) -> Nanos | None:
        moments = (moment for moment in (self._due, self._passing()) if moment is not None)
        return min(moments, default=None)

    def _passing(self) -> Nanos | None:
        """When a belt that moves brings a workpiece under the cup, or takes it away."""
        source, now = self.source, self.board.kernel.now
        if source is None or self.carried is not None or not (self.board.is_on(EJECTOR) and self.board.is_on(PICK)):
            return None
        edges = source.load.edges(self._pick_at, source.drive.place(now))
        return next_change(source.drive, *edges, now)


# ---------------------------------------------------------------------- the element


def _leak(active: ActiveFault, vacuum: Vacuum, begins: bool, now: Nanos) -> str:
    vacuum.leaks = begins
    return f"{vacuum.board.name} {'leaks' if begins else 'is tight again'}"


def _make(spec: VacuumSpec, site: Site) -> Vacuum:
    source, onto = (None if name is None else find_conveyor(name, site) for name in (spec.source, spec.onto))
    return Vacuum(site.board(spec.name), spec, source, onto)


def _signals(vacuum: Vacuum) -> Mapping[str, SignalOf]:
    source = (vacuum.board.source,)

    def turning(now: Nanos) -> Iterator[Nanos]:
        yield from ()

    bounds = (0.0, vacuum.spec.vacuum)
    return {
        "pressure": SignalOf(source, vacuum.pressure, turning, lambda: vacuum.version, unit="kPa", bounds=bounds),
        "dropped": SignalOf(source, lambda now: float(vacuum.dropped)),
    }


VACUUM = with_terminals(
    "vacuum",
    VacuumSpec,
    (
        optional(OUTPUT_PIN, "ejector", "output joined to EJECTOR; without it a wire may be"),
        optional(OUTPUT_PIN, "pick", "output joined to PICK: the cup is where it picks up"),
        optional(OUTPUT_PIN, "place", "output joined to PLACE: the cup is where it puts down"),
        optional(
            NameOf("conveyor"),
            "from",
            "conveyor that it picks from; without one a workpiece is there whenever PICK is on",
            None,
            "source",
        ),
        optional(number(0.0), "pick_at", "with from: mm from the beginning of the belt", 0.0),
        optional(NameOf("conveyor"), "onto", "conveyor that it puts on"),
        optional(number(0.0), "place_at", "with onto: mm from the beginning of the belt, of the front of the workpiece", 0.0),
        optional(number(0.0, 101.0, above=True), "vacuum", "kPa below the pressure of the air, with a closed cup", 70.0),
        optional(number(0.0, 101.0, above=True), "threshold", "kPa, from which HELD is on", 50.0),
        optional(positive_time, "build_up", "from 0 to the threshold", 100 * MILLISECOND),
        optional(positive_time, "release", "from vacuum to the threshold", 40 * MILLISECOND),
    ),
    make=_make,
    signals=_signals,
    faults=(
        STUCK_OUTPUT,
        FaultKind("leak", Layer.ELEMENT, Occasion.ALWAYS, "A suction cup does not hold a vacuum.", effect=ElementEffect(_leak)),
    ),
)
