"""``[[axis.switch]]``: a contact that is on where its axis stands in its zone."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction

from steptwin.messages import Message
from steptwin.simulation.components.contact import ContactSpec
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.logic.contacts import MovingPart, Switch, Zone
from steptwin.simulation.mechanics.drawing import SensorZone
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import number


@table("[[axis.switch]]")
class SwitchSpec(ContactSpec):
    """On at and below ``below``, at and above ``above``, or around ``position`` over ``width``, again after each ``period``.

    Units of the axis.
    """

    below: float | None = key(number(), "on at and below this position, in the unit of what moves", default=None)
    above: float | None = key(number(), "on at and above this position, likewise", default=None)
    position: float | None = key(number(), "on around this position, likewise", default=None)
    width: float = key(number(0.0), "how wide the zone around position is, likewise", default=0.0, needs="position")
    period: float | None = key(
        number(0.0, above=True),
        "the zone repeats after each, likewise; default a turn of a rotary axis",
        default=None,
        needs="position",
    )
    hysteresis: float = key(number(0.0), "how much further it stays on, likewise", default=0.0)

    @property
    def zone(self) -> SensorZone:
        """Where it is on, as it is drawn."""
        if self.position is None:
            return SensorZone(self.target, self.above, self.below)
        half = self.width / 2
        return SensorZone(self.target, self.position - half, self.position + half, self.period)

    def check(self, text: TomlText) -> None:
        if sum(text.is_given((*self.path, name)) for name in ("below", "above", "position")) != 1:
            text.wrong(self.path, "D007", "a switch needs one of below, above and position")


NEVER_ON = Message("simulation.switch-never-on", "this switch is never on: {name} goes from {low:g} to {high:g}")
ALWAYS_ON = Message("simulation.switch-always-on", "this switch is always on: {name} goes from {low:g} to {high:g}")
CHANGE_WITHIN = Message(
    "simulation.switch-within-hint", "let it change between {low:g} and {high:g}, or give {name} another travel"
)


def warn_of_useless(text: TomlText, switches: Iterable[SwitchSpec], name: str, travel: tuple[float, float]) -> None:
    """Warn of switches that do not change within a travel. Those with a period are somewhere in it."""
    least, most = travel
    for one in switches:
        _, low, high, period = one.zone
        if period is not None:
            continue
        is_never = (low is not None and low > most) or (high is not None and high < least)
        is_always = (low is None or low <= least) and (high is None or high >= most)
        given = next((key for key in ("below", "above", "position") if text.is_given((*one.path, key))), None)
        if given is not None and is_never is not is_always:
            message = (NEVER_ON if is_never else ALWAYS_ON)(name=name, low=least, high=most)
            text.warn((*one.path, given), "D011", message, CHANGE_WITHIN(name=name, low=least, high=most))


def channel_of(axis: str, number: int) -> str:
    """Under which a switch of an axis is recorded; they count from 1."""
    return f"{axis}.switch{number}"


def put_switch(
    scheduler: Scheduler,
    carriage: MovingPart,
    moved_by: str | tuple[str, ...],
    zone: Zone,
    spec: ContactSpec,
    channel: str,
    context: ElementContext,
) -> None:
    """Put a switch where a carriage, which the controllers or elements ``moved_by`` move, runs over it."""
    circuit = context.circuit(scheduler, spec.target, (*spec.path, "to"), spec.join)
    component = Switch(
        circuit,
        carriage,
        zone,
        scheduler.now,
        normally_closed=spec.contact == "NC",
        bounce_ns=spec.bounce,
        bounces=spec.bounces,
        chance=context.bounce_of(circuit),
        channel=channel,
    )
    scheduler.add_part(component, (moved_by,) if isinstance(moved_by, str) else moved_by, drives=circuit.target.controller)


def zone_of(spec: SwitchSpec, to_grid: Callable[[float], int], period: Fraction | int | None = None) -> Zone:
    """Where a switch is on. ``to_grid`` converts units to the grid of its carriage, ``period`` is there from zone to zone."""
    if spec.position is not None:
        half = 0.5 * spec.width
        return Zone(to_grid(spec.position - half), to_grid(spec.position + half), to_grid(spec.hysteresis), period)
    low, high = (None if end is None else to_grid(end) for end in (spec.above, spec.below))
    return Zone(low, high, to_grid(spec.hysteresis))
