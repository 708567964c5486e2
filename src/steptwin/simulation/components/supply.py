"""``[[supply]]``: a power supply of controllers: its voltage rises and falls, and controllers are on while it is sufficient."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import ceil
from typing import Any, ClassVar, NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.faultsetup import FaultSetup
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.controller import FaultyController
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import FaultCategory
from steptwin.simulation.faults.table import number as parameter
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, flag, name_value, number, permitting, time_value

ON, GOOD = "ON", "GOOD"
USUAL_SHARE = 0.75
"""Share of the voltage from which on controllers are on by default."""
MOST_FED = 1000


@permitting("name, or list of names")
def _names(value: Any) -> tuple[str, ...]:
    names = value if isinstance(value, list) else [value]
    if not 1 <= len(names) <= MOST_FED:
        raise Misuse(f"{len(names)} controllers: permitted are 1 to {MOST_FED}")
    found = tuple(name_value(name) for name in names)
    if len(set(found)) < len(found):
        raise Misuse(f"{value!r}: a controller is named twice")
    return found


@table("[[supply]]")
class SupplySpec(TerminalComponentSpec):
    """Voltages in V."""

    feeds: tuple[str, ...] = key(_names, "the controllers that it feeds: a name, or a list of them")
    on: Terminal | None = key(OUTPUT_PIN, "output connected to ON, such as the output good of another supply", default=None)
    switched: bool = key(
        flag, "whether wires or contacts switch ON; without it and on: it is on from the beginning", default=False
    )
    volts: float = key(number(0.0, above=True), "V of its output", default=24.0)
    enough: float | None = key(
        number(0.0, above=True), "V from which on its controllers are on; default three quarters of volts", default=None
    )
    delay: Nanos = key(time_value, "from ON until the voltage rises", default=0)
    rise: Nanos = key(time_value, "from 0 to all of the voltage", default=50 * MILLISECOND)
    hold_up: Nanos = key(time_value, "after ON until the voltage falls", default=20 * MILLISECOND)
    fall: Nanos = key(time_value, "from all of the voltage to 0", default=100 * MILLISECOND)

    @property
    def is_switched(self) -> bool:
        return self.switched or self.on is not None

    @property
    def threshold(self) -> float:
        return USUAL_SHARE * self.volts if self.enough is None else self.enough

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(ON,) if self.is_switched else (), outputs=(GOOD,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.on is not None:
            yield Joint("on", ON, self.on)

    def others(self, described: ElementSpecs) -> Iterator[tuple[str, str]]:
        yield from (("feeds", name) for name in self.feeds)

    def check(self, text: TomlText) -> None:
        if self.enough is not None and self.enough > self.volts:
            message = f"enough = {self.enough:g} V is more than volts = {self.volts:g}"
            text.wrong((*self.path, "enough"), "D007", message)


class Ramp(NamedTuple):
    """A voltage from ``begin`` on, ``volts`` then, that goes to ``target`` at ``rate`` V/ns (0: at once)."""

    begin: Nanos
    volts: float
    target: float
    rate: float

    @property
    def end(self) -> Nanos:
        return self.begin + (ceil(abs(self.target - self.volts) / self.rate) if self.rate else 0)

    def at(self, now: Nanos) -> float:
        if now >= self.end:
            return self.target
        change = self.rate * (now - self.begin)
        return self.volts + change if self.target > self.volts else self.volts - change

    def crosses(self, level: float, after: Nanos) -> Nanos | None:
        """First moment after one at which it is on the other side of a level: at or above it, or below."""
        high = self.at(after) >= level
        if (self.target >= level) is high:
            return None
        low, found = after, max(self.end, after + 1)
        while found - low > 1:
            middle = (low + found) // 2
            low, found = (middle, found) if (self.at(middle) >= level) is high else (low, middle)
        return found


SUPPLY_IS_ON = Message("simulation.supply-is-on", "{supply} is on, with {fed}")
SUPPLY_IS_OFF = Message("simulation.supply-is-off", "{supply} is off, with {fed}")


class Supply(TerminalComponent):
    """GOOD is on, and so are the controllers, while its voltage is sufficient."""

    FIXED: ClassVar[tuple[str, ...]] = ("_fed", "_spec")
    __slots__ = (*FIXED, "_is_on", "_is_wanted", "_ramp", "_switch_due", "is_good", "sag")

    def __init__(self, block: TerminalBlock, spec: SupplySpec, fed: tuple[FaultyController, ...]) -> None:
        super().__init__(block)
        self._spec = spec
        self._fed = fed
        self._ramp = Ramp(block.scheduler.now, 0.0, 0.0, 0.0)
        self._is_wanted = False
        self._is_on = False
        self._switch_due: Nanos | None = None
        self.is_good = False
        self.sag: float | None = None
        """Fault: the voltage that it has at most."""
        for controller in fed:
            controller.supply(False, block.scheduler.now)

    def volts(self, now: Nanos) -> float:
        return self._ramp.at(now)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        if self._ramp.end > now:
            yield self._ramp.end

    def version(self) -> object:
        return self._ramp

    @property
    def full(self) -> float:
        return self._spec.volts

    def update(self, now: Nanos) -> None:
        self._switch(now)  # before the input changes: an input at a moment comes after what is due then
        is_wanted = not self._spec.is_switched or self.block.is_on(ON)
        if is_wanted is not self._is_wanted:
            self._is_wanted = is_wanted
            wait = self._spec.delay if is_wanted else self._spec.hold_up
            self._switch_due = None if is_wanted is self._is_on else now + wait
            self._switch(now)
        self._aim(now)
        is_good = self.volts(now) >= self._spec.threshold
        if is_good is not self.is_good:
            self.is_good = is_good
            self._feed(now)
        self.block.put(GOOD, float(is_good))

    def _switch(self, now: Nanos) -> None:
        if self._switch_due is not None and self._switch_due <= now:
            self._switch_due = None
            self._is_on = self._is_wanted

    def _aim(self, now: Nanos) -> None:
        """Let the voltage go to where it has to be."""
        spec = self._spec
        target = (spec.volts if self.sag is None else min(spec.volts, self.sag)) if self._is_on else 0.0
        if target == self._ramp.target:
            return
        volts = self.volts(now)
        takes = spec.rise if target > volts else spec.fall
        self._ramp = Ramp(now, volts, target, spec.volts / takes if takes else 0.0)

    @property
    def lacks_voltage(self) -> bool:
        """Whether only a fault keeps its voltage low."""
        return self._is_on and self.sag is not None and self.sag < self._spec.volts

    def _feed(self, now: Nanos) -> None:
        for controller in self._fed:
            controller.supply(self.is_good, now)
        scheduler, name = self.block.scheduler, self.block.name
        fed = self._spec.feeds
        text = (SUPPLY_IS_ON if self.is_good else SUPPLY_IS_OFF)(supply=name, fed=list(fed))
        facts = ("element", name), ("on", self.is_good), ("fed", ", ".join(fed))
        scheduler.record(scheduler.owner(name), "event", "supply", text, *facts)

    def deadline(self) -> Nanos | None:
        now = self.block.scheduler.now
        deadlines = (self._switch_due, self._ramp.crosses(self._spec.threshold, now), next(self.turning_points(now), None))
        return min((due for due in deadlines if due is not None), default=None)


FULL_VOLTAGE = Message("simulation.full-voltage", "{name} has all of its voltage again")
SAGS = Message("simulation.supply-sags", "{name} has {volts:g} V at most")


def _sag(active: ActiveFault, supply: Supply, begins: bool, now: Nanos) -> str:
    supply.sag = active.fault.number("volts") if begins else None
    return FULL_VOLTAGE(name=supply.block.name) if supply.sag is None else SAGS(name=supply.block.name, volts=supply.sag)


def _lacks_voltage(active: ActiveFault, supply: Supply, now: Nanos) -> bool:
    return supply.lacks_voltage


def _check_order(spec: SupplySpec, context: ElementContext) -> None:
    """Raises `Misuse` for supplies that wait for one another."""
    waits_for = {one.name: one.on[0] for one in context.objects.described.of(SUPPLY) if one.on is not None and one.on[1] == GOOD}
    way = [spec.name]
    while (before := waits_for.get(way[-1])) is not None and before not in way[1:]:
        way.append(before)
        if before == spec.name:
            raise Misuse(f"on: {' waits for '.join(way)}, so that it never comes on")


def _make(spec: SupplySpec, context: ElementContext) -> Supply:
    context.memo.once((*spec.path, "order"), lambda: _check_order(spec, context))
    fault_setup = FaultSetup(context.objects)
    context.objects.faults.expect_supplies()
    fed = []
    for name in spec.feeds:
        context.controller(name)
        other = context.objects.supplied.get(name)
        if other is not None:
            raise Misuse(f"feeds: {name!r} has the supply {other!r} already")
        context.objects.supplied[name] = spec.name
        fed.append(fault_setup.prepare_for_faults(name))
    return Supply(context.terminal_block(spec.name), spec, tuple(fed))


def _signals(supply: Supply) -> Mapping[str, SignalOf]:
    of = SignalOf((supply.block.source,), supply.volts, supply.turning_points, supply.version, "V", (0.0, supply.full))
    return {"volts": of}


SUPPLY = with_terminals(
    SupplySpec,
    make=_make,
    signals=_signals,
    faults=(
        *STUCK,
        FaultKind(
            "brown-out",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A power supply has less voltage; its controllers are off while that is not enough.",
            own=(parameter("volts", "V that it has at most.", 0.0, 1000.0, default=12.0),),
            effect=ElementEffect(_sag, _lacks_voltage),
            faulty=FaultCategory.POWER,
        ),
    ),
)
