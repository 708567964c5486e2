"""``campaign.toml`` as values: which world, what varies, what is done to it, what must hold and what is measured."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

from steptwin import __version__
from steptwin.campaign.case import digest_of
from steptwin.campaign.variation import MOST_LEVELS, Choice, Varied
from steptwin.controller import SECOND, Nanos
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.simulation.describe.blueprint import FileContents
from steptwin.simulation.describe.spec import SEED
from steptwin.simulation.logic.expression import parse_condition
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import flag, name_value, number, positive_time, text_value, whole, word

SEARCHES = ("random", "exhaustive", "guided")
SALTELLI = "saltelli"
DESIGNS = ("random", "grid", "latin-hypercube", "sobol", SALTELLI)


MOST_RUNS = 1_000_000_000
MOST_PHASES = 1000
TIMED = ("always", "never", "eventually", "after")
"""Keys of properties that are their first words."""


def _condition(value: Any) -> str:
    parse_condition(text_value(value))
    return value


def _list(value: Any) -> tuple[Any, ...]:
    if not isinstance(value, list) or not value or any(not isinstance(item, bool | int | float | str) for item in value):
        raise Misuse(f"{value!r}: expected a list of numbers, texts or truth values")
    for item in value:
        if isinstance(item, int | float) and not isinstance(item, bool):
            number()(item)  # neither nan nor beyond what is permitted
    return tuple(value)


def _number_or_time(value: Any) -> tuple[float, bool]:
    """A number, or seconds and whether it is a time."""
    return (duration(value) / SECOND, True) if isinstance(value, str) else (number()(value), False)


def _ends(value: Any) -> tuple[float, float, bool]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [low, high], such as [0.1, 0.4] or ['0 s', '2 s']")
    (low, is_time), (high, also) = map(_number_or_time, value)
    if is_time is not also:
        raise Misuse(f"{value!r}: expected two numbers or two times")
    if low >= high:
        raise Misuse(f"{value!r}: the first must be below the second")
    return low, high, is_time


def _normal(value: Any) -> tuple[float, float, bool]:
    if not isinstance(value, Mapping) or set(value) != {"mean", "deviation"}:
        raise Misuse(f"{value!r}: expected {{ mean = NUMBER, deviation = NUMBER }}")
    (mean, is_time), (deviation, also) = _number_or_time(value["mean"]), _number_or_time(value["deviation"])
    if is_time is not also:
        raise Misuse(f"{value!r}: expected two numbers or two times")
    if deviation <= 0:
        raise Misuse(f"deviation = {value['deviation']!r}: must be more than 0")
    return mean, deviation, is_time


def _moment(value: Any) -> Nanos | str:
    """A time, or the name of one that varies."""
    try:
        return duration(value)
    except Misuse:
        if not isinstance(value, str) or not value[:1].isalpha():
            raise
        return name_value(value)


def _step(value: Any) -> str:
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected a step of a script, such as {{ press = 'start' }}")
    return step_text(value)


def step_text(table: Mapping[str, Any]) -> str:
    """A step as `StepAt` has it."""
    return json.dumps(table, ensure_ascii=False)


@dataclass(frozen=True, slots=True)
class VariedFault:
    """``do`` is in words, with ``{name}`` for what varies. ``at``: ns, or the name of a time that varies."""

    do: str
    at: Nanos | str
    chance: float


@dataclass(frozen=True, slots=True)
class VariedStep:
    """``do`` is the table of the step as JSON, with ``{name}`` for what varies."""

    do: str
    at: Nanos | str


@dataclass(frozen=True, slots=True)
class NamedProperty:
    """A property as it is written, with its name for people."""

    name: str
    text: str


@table("[[measure]]")
class Measure(TableSpec):
    """A number that is kept of each run: ``value``, a signal at its end, or the time in s until ``when`` comes true first."""

    name: str = key(text_value, "for people")
    value: str | None = key(text_value, "a signal, read at the end of a run", default=None)
    when: str | None = key(
        _condition, "a condition: the moment at which it comes true first, s", default=None, excludes=("value",)
    )

    def check(self, text: TomlText) -> None:
        if (self.value is None) is (self.when is None):
            text.wrong(self.path, "D007", "[[measure]] needs one of value and when")


@table("[matrix]")
class MatrixRules(TableSpec):
    """Rules for effects. Without ``done``, a run made its parts if it ends as that without a fault, and no wait of a script has
    run out of time."""

    done: str | None = key(
        _condition, "true at the end of a run that made its parts; default: it ends as without a fault", default=None
    )
    alarm: str | None = key(_condition, "how the machine says that it noticed something", default=None)
    phases: int | None = key(whole(1, MOST_PHASES), "how many of the cycle are tried at most", default=None)
    product: tuple[str, ...] = key(_list, "names of properties whose failure is a wrong part, not a danger", default=())


@table("[[vary]]")
class VaryTable(TableSpec):
    """A value that varies, by its path in the world or by a name, and how."""

    of: str | None = key(text_value, "of a value of the world, as --with has it", default=None, name="path")
    name: str | None = key(name_value, "a name that other tables refer to as {name}", default=None, excludes=("path",))
    between: tuple[float, float, bool] | None = key(_ends, "[low, high], numbers or times", default=None)
    normal: tuple[float, float, bool] | None = key(
        _normal, "{ mean = NUMBER, deviation = NUMBER }; between cuts it off", default=None
    )
    choose: tuple[Any, ...] | None = key(
        _list, "a list of values, one of which is drawn", default=None, excludes=("between", "normal")
    )
    grid: tuple[Any, ...] | None = key(
        _list, "a list of values, each with each of other grids", default=None, excludes=("choose", "between", "normal")
    )
    log: bool = key(flag, "between: uniform in the logarithm", default=False, needs="between", excludes=("normal",))
    is_whole: bool = key(flag, "between: whole numbers", default=False, name="whole", needs="between", excludes=("normal", "log"))
    levels: int = key(
        whole(2, MOST_LEVELS),
        "between: so many equidistant values, for the design grid",
        default=0,
        needs="between",
        excludes=("normal",),
    )


@table()
class _At(TableSpec):
    at: Nanos | str | None = key(
        _moment, "a moment, or the name of a time that varies; default where runs begin to vary", default=None
    )


@table("[[fault]]")
class FaultTable(_At):
    do: str = key(text_value, "KIND NAME=VALUE ..., with {name} for what varies ('steptwin fault --kinds')", order=-1)
    chance: float = key(number(0.0, 1.0, above=True), "of being there", default=1.0)


@table("[[step]]")
class StepTable(_At):
    do: str = key(_step, "a step of a script, such as { press = 'start' }, with '{name}' for what varies", order=-1)


@table("[[property]]")
class PropertyTable(TableSpec):
    name: str | None = key(text_value, "for people; default the property as it is written", default=None)
    holds: str | None = key(text_value, "a property, or a ready one by its name, such as 'no-collision'", default=None)
    always: str | None = key(
        text_value, "what holds at every moment, such as 'x.position < 300'", default=None, excludes=("holds",)
    )
    never: str | None = key(text_value, "what holds at no moment", default=None, excludes=("holds", "always"))
    eventually: str | None = key(
        text_value,
        "what comes true in the run, such as 'within 2 s x.position > 100'",
        default=None,
        excludes=("holds", "always", "never"),
    )
    after: str | None = key(
        text_value,
        "what follows, such as 'stop.pressed within 300 ms not table.M1.moving'",
        default=None,
        excludes=("holds", "always", "never", "eventually"),
    )


@table("[campaign]")
class CampaignTable(TableSpec):
    """``world``: the name of its description, for messages. Times in ns, ``time_ns`` of the wall clock."""

    world: str = key(text_value, "the description of the world, beside this file")
    end_ns: Nanos = key(positive_time, "the virtual time of a run", name="end")
    name: str = key(text_value, "for people; default that of the file", default="")
    runs: int | None = key(whole(1, MOST_RUNS), "how many; default as many as the grid has", default=None)
    time_ns: Nanos | None = key(positive_time, "of the clock on the wall: no run begins later", default=None, name="time")
    until_failure: bool = key(flag, "end after the first run that fails", default=False)
    seed: int = key(SEED, "where all chance comes from", default=0)
    design: str = key(word(*DESIGNS), "how values are drawn", default=DESIGNS[0])
    search: str = key(word(*SEARCHES), "how cases are chosen", default=SEARCHES[0])
    until: str | None = key(_condition, "a condition that ends a run earlier", default=None)
    start_ns: Nanos | None = key(
        positive_time, "the end of the beginning that all runs have in common", default=None, name="start"
    )
    expectations: bool = key(flag, "whether a run fails where a script expects or waits for something in vain", default=True)
    database: str | None = key(
        text_value, "of the results: postgresql://HOST/NAME; default a file beside the results", default=None
    )


@dataclass(frozen=True, kw_only=True)
class CampaignDescription(CampaignTable):
    """All that runs depend on, the world with its files included: it pickles, and needs no other file where it runs."""

    text: str
    """The description of the world."""
    files: FileContents
    vary: tuple[Varied, ...]
    faults: tuple[VariedFault, ...]
    steps: tuple[VariedStep, ...]
    properties: tuple[NamedProperty, ...]
    measures: tuple[Measure, ...]
    matrix: MatrixRules
    """Settings of the fault matrix."""

    @property
    def times(self) -> tuple[str, ...]:
        """Names of the values that vary as times."""
        return tuple(one.name for one in self.vary if not isinstance(one.spread, Choice) and one.spread.is_time)

    @cached_property
    def digest(self) -> str:
        """Equal for campaigns whose cases with the same number have the same results."""
        return digest_of(self._decisive())

    def _decisive(self) -> Mapping[str, Any]:
        left = {"runs", "time_ns", "until_failure", "database", "files", "name", "matrix", "world", "path"}
        data: dict[str, Any] = {"version": __version__} | {
            one.name: repr(getattr(self, one.name)) for one in fields(self) if one.name not in left
        }
        if self.design == "latin-hypercube":  # its points depend on how many there are
            data["runs"] = self.runs
        return data | {"files": {name: content.hex() for name, content in self.files.items()}}
