"""Any quantity of a move from the others, for a model of a controller.

All quantities but one, and a time (total, or of a part), give the one that is left out: what is tried out is the controller's own
plan. The result is for values that the controller takes: whole pulses, whole steps/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import isnan

from steptwin.calc.contract import (
    ACCELERATION,
    CONSTANT,
    DECELERATION,
    DISTANCE,
    FALL,
    RISE,
    TIME,
    VELOCITY,
    Calculation,
    Model,
    MovePhase,
    MoveQuantity,
    RequiredSetting,
    curve,
)
from steptwin.calc.solving import is_same, solve
from steptwin.calc.units import Dimension
from steptwin.datasheet import Limits
from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.motion import Profile
from steptwin.nearmiss import NearMiss

LONGEST_S = 366 * 24 * 3600.0


def _time(name: str, meaning: str) -> MoveQuantity:
    limits = Limits(0.0, LONGEST_S, is_low_excluded=True)
    return MoveQuantity(name=name, meaning=meaning, dimension=Dimension.TIME, unit="s", limits=limits, source="")


TIMES = (
    _time(TIME, "Total time"),
    _time(RISE, "Time of acceleration"),
    _time(CONSTANT, "Time at constant velocity"),
    _time(FALL, "Time of deceleration"),
)
"""At most one of them may be given, instead of one quantity."""
TIME_NAMES = tuple(time.name for time in TIMES)
PARTS_OF = {"rises": RISE, "stays": CONSTANT, "falls": FALL}


UNKNOWN_QUANTITY = Message("calc.unknown-quantity", "no quantity {name!r}{hint}: quantities are {names}")
TWO_TIMES = Message("calc.two-times", "{times}: one time determines what is left out, two cannot both be wanted")
TIME_IS_NEEDED = Message("calc.time-is-needed", "to calculate {find} a time is needed: one of {names}")
TIME_AND_RESULT = Message(
    "calc.time-and-result", "{time} is given, so {find} follows: name what is to be calculated, or leave out the time"
)
CHOICE_IS_NOT_CALCULATED = Message(
    "calc.choice-is-not-calculated", "{find} cannot be calculated, it is a choice: calculated are {names}"
)
MISSING_TO_CALCULATE = Message("calc.missing-to-calculate", "{missing}: missing to calculate {find}")
TIME_DETERMINES_ONE = Message("calc.time-determines-one", "{missing}: a time determines one of them, give the others")
ALL_IS_GIVEN = Message("calc.all-is-given", "all is given, and a time: name what is to be calculated instead, one of {names}")
MISSING = Message("calc.missing", "{missing}: missing; give them, or leave one of them out and give a time ({times})")
OUT_OF_RANGE = Message("calc.out-of-range", "{quantity} = {value}: permitted {permitted}")
TIME_IS_FIXED = Message("calc.time-is-fixed", "{time} = {wanted} cannot be: it is {actual}, whatever {unknown} is")
POSSIBLE_TIMES = Message("calc.possible-times", "{least} to {most}")
TIME_IS_IMPOSSIBLE = Message("calc.time-is-impossible", "{time} = {wanted} cannot be: with {unknown} {range} it is {possible}")
TAKEN_AS = Message("calc.taken-as", "{name} {wanted:.10g} {unit} is taken as {value:.10g} {unit}")
OTHER_TIME = Message("calc.other-time", "with values that the controller takes, {name} is {value} instead of {wanted}")
LESS_THAN_A_STEP = Message("calc.less-than-a-step", "distance = {distance:g} {unit}: is less than the controller's step")


class Calculator:
    """For one model of a controller."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.quantities: Mapping[str, MoveQuantity] = {one.name: one for one in (*model.quantities, *TIMES)}

    def calculate(self, given: Mapping[str, float], find: str | None = None) -> Calculation:
        """The move of ``given`` values by the names of quantities. With a time, ``find`` (or the only one that is left out) is
        calculated. Raises `Misuse` for values outside their range, too few or too many of them, and times that cannot be."""
        self._check_names(given, find)
        for name, value in given.items():
            self._check_range(self.quantities[name], value)
        wanted = self._wanted_time(given, find)
        known = {name: value for name, value in given.items() if name not in TIME_NAMES and name != find}
        unknown = find if wanted is None else self._unknown(known, find)
        exact = None
        if unknown is not None and wanted is not None:
            self._check_together({**known, unknown: self.quantities[unknown].limits.high or 1.0})
            exact = self._solved(unknown, known, wanted, given[wanted])
            known[unknown] = exact
        values = self._complete(known)
        self._check_together(values)
        return self._result(values, unknown, exact, given.get(wanted) if wanted else None, wanted)

    # ------------------------------------------------------------------ what was given

    def _check_names(self, given: Mapping[str, float], find: str | None) -> None:
        for name in (*given, *(() if find is None else (find,))):
            if name not in self.quantities:
                hint = NearMiss().hint(name, self.quantities)
                raise Misuse(UNKNOWN_QUANTITY(name=name, hint=hint, names=list(self.quantities)))

    def _wanted_time(self, given: Mapping[str, float], find: str | None) -> str | None:
        times = [name for name in given if name in TIME_NAMES]
        if len(times) > 1:
            raise Misuse(TWO_TIMES(times=" and ".join(times)))
        if not times and find is not None and find not in TIME_NAMES:
            raise Misuse(TIME_IS_NEEDED(find=find, names=list(TIME_NAMES)))
        if times and find in TIME_NAMES:
            raise Misuse(TIME_AND_RESULT(time=times[0], find=find))
        return times[0] if times else None

    def _unknown(self, known: Mapping[str, float], find: str | None) -> str:
        """The quantity that a time determines."""
        needed = [one.name for one in self.model.quantities if one.default is None and one.same_as is None]
        missing = [name for name in needed if name not in known and name != find]
        can = [one.name for one in self.model.quantities if not one.choices]
        if find is not None:
            if find not in can:
                raise Misuse(CHOICE_IS_NOT_CALCULATED(find=find, names=list(can)))
            if missing:
                raise Misuse(MISSING_TO_CALCULATE(missing=list(missing), find=find))
            return find
        if len(missing) == 1:
            return missing[0]
        if missing:
            raise Misuse(TIME_DETERMINES_ONE(missing=list(missing)))
        raise Misuse(ALL_IS_GIVEN(names=list(can)))

    def _complete(self, known: Mapping[str, float]) -> dict[str, float]:
        """With defaults. Raises `Misuse` for what is missing."""
        values = dict(known)
        for one in self.model.quantities:
            if one.name not in values and one.default is not None:
                values[one.name] = one.default
        for one in self.model.quantities:
            if one.name not in values and one.same_as in values:
                values[one.name] = values[one.same_as]
        missing = [one.name for one in self.model.quantities if one.name not in values and one.same_as is None]
        if missing:
            raise Misuse(MISSING(missing=list(missing), times=list(TIME_NAMES)))
        return {one.name: values[one.name] for one in self.model.quantities}

    def _check_together(self, known: Mapping[str, float]) -> None:
        self.model.check(self._complete({DISTANCE: 1.0, **known}))

    def _check_range(self, quantity: MoveQuantity, value: float) -> None:
        size = abs(value) if quantity.name == DISTANCE else value
        limits = quantity.limits
        low, high = limits.low or 0.0, limits.high
        is_low = size <= low if limits.is_low_excluded else size < low
        is_wrong = value not in quantity.choices if quantity.choices else is_low or not (high is None or size <= high)
        if is_wrong or isnan(value):
            given = f"{value:.10g} {quantity.unit}".rstrip()
            raise Misuse(OUT_OF_RANGE(quantity=quantity.name, value=given, permitted=range_text(quantity)))

    # ------------------------------------------------------------------ what follows

    def _solved(self, unknown: str, known: Mapping[str, float], wanted: str, seconds: float) -> float:
        """The value at which the wanted time is ``seconds``. Raises `Misuse` with the times that are possible."""
        quantity = self.quantities[unknown]
        low, high = _least(quantity), quantity.limits.high or LARGEST
        timed = partial(self._timed, unknown, known)
        if unknown == VELOCITY and wanted in (RISE, FALL):
            # Beyond the velocity that is just reached these times do not grow any more (a parabolic part makes them shorter).
            constant = partial(timed, CONSTANT)
            top = solve(constant, 0.0, low, high) if constant(high) == 0.0 else None
            high = high if top is None else top
        found = solve(partial(timed, wanted), seconds, low, high)
        if found is None:
            ends = sorted((timed(wanted, low), timed(wanted, high)))
            which = self.quantities[wanted].meaning.lower()
            if is_same(*ends):
                raise Misuse(
                    TIME_IS_FIXED(time=text_of(which), wanted=_seconds(seconds), actual=_seconds(ends[0]), unknown=unknown)
                )
            raise Misuse(
                TIME_IS_IMPOSSIBLE(
                    time=text_of(which),
                    wanted=_seconds(seconds),
                    unknown=unknown,
                    range=range_text(quantity),
                    possible=POSSIBLE_TIMES(least=_seconds(ends[0]), most=_seconds(ends[1])),
                )
            )
        return found

    def _timed(self, unknown: str, known: Mapping[str, float], wanted: str, value: float) -> float:
        return _times(self.model.plan(self._complete({**known, unknown: value})))[wanted]

    def _result(
        self, exact_values: dict[str, float], unknown: str | None, exact: float | None, seconds: float | None, wanted: str | None
    ) -> Calculation:
        values = {name: self.model.settable(name, value, exact_values) for name, value in exact_values.items()}
        notes = []
        for name, value in values.items():
            unit = self.quantities[name].unit
            if name != unknown and not is_same(value, exact_values[name]):
                notes.append(TAKEN_AS(name=name, wanted=exact_values[name], value=value, unit=unit))
        if values[DISTANCE] == 0.0:
            raise Misuse(LESS_THAN_A_STEP(distance=exact_values[DISTANCE], unit=self.quantities[DISTANCE].unit))
        profile = self.model.plan(values)
        times = _times(profile)
        if seconds is not None and wanted is not None and abs(times[wanted] - seconds) > SHOWN * seconds:
            notes.append(OTHER_TIME(name=wanted, value=_seconds(times[wanted]), wanted=_seconds(seconds)))
        speed_pulses = self.quantities[VELOCITY].pulses
        peak = max(_peaks(profile), default=0.0) / speed_pulses
        return Calculation(
            title=self.model.title,
            found=unknown,
            exact=exact,
            values=values,
            units={name: self.quantities[name].unit for name in values},
            times=times,
            peak=peak,
            reaches=is_same(peak, values[VELOCITY]),
            parts=tuple(self._parts(profile)),
            formulas=tuple(self.model.formulas(values, profile)),
            notes=(*notes, *self.model.notes(values, profile)),
            settings=tuple(
                RequiredSetting(one.name, one.code, one.detail, values[one.name], one.unit)
                if values[one.name] >= 0.0 or not one.back
                else RequiredSetting(one.name, one.back, one.detail, -values[one.name], one.unit)
                for one in self.model.quantities
                if one.code
            ),
            curve=curve(profile, self.quantities[DISTANCE].pulses, speed_pulses),
            profile=profile,
        )

    def _parts(self, profile: Profile) -> list[MovePhase]:
        parts: list[MovePhase] = []
        begin, at_p = 0.0, 0.0
        speed, pulses = self.quantities[VELOCITY].pulses, self.quantities[DISTANCE].pulses
        names = {"rises": ACCELERATION, "stays": "constant velocity", "falls": DECELERATION}
        for segment, phase in zip(profile.segments, _phases(profile), strict=True):
            shape = f"parabolic {names[phase]}" if segment.c3 else names[phase]
            end_p = segment.position(segment.end_s)
            first, last = abs(segment.velocity(begin)) / speed, abs(segment.velocity(segment.end_s)) / speed
            parts.append(MovePhase(shape, begin, segment.end_s - begin, first, last, (end_p - at_p) / pulses))
            begin, at_p = segment.end_s, end_p
        return parts


SHOWN = 1e-6
"""Relative: smaller differences are not visible in printed numbers."""
LARGEST = 1e12
LEAST_PART = 1e-9
"""Least value that is tried of a quantity whose range begins at 0, relative to a pulse."""


def _least(quantity: MoveQuantity) -> float:
    low = quantity.limits.low or 0.0
    return low if low > 0.0 else LEAST_PART / quantity.pulses


def _phases(profile: Profile) -> list[str]:
    """Whether the speed rises, stays or falls, by segment."""
    return ["stays" if not one.c2 else "rises" if one.c2 * one.direction > 0.0 else "falls" for one in profile.segments]


def _times(profile: Profile) -> dict[str, float]:
    times = dict.fromkeys(TIME_NAMES, 0.0)
    begin = 0.0
    for segment, phase in zip(profile.segments, _phases(profile), strict=True):
        times[PARTS_OF[phase]] += segment.end_s - begin
        begin = segment.end_s
    times[TIME] = begin
    return times


def _peaks(profile: Profile) -> list[float]:
    begin, peaks = 0.0, []
    for segment in profile.segments:
        peaks += [abs(segment.velocity(begin)), abs(segment.velocity(segment.end_s))]
        begin = segment.end_s
    return peaks


def _seconds(seconds: float) -> str:
    return f"{seconds:.6g} s"


ABOVE = Message("calc.above", "above {low:.10g}{unit}")
FROM = Message("calc.from", "from {low:.10g}{unit}")
ABOVE_UP_TO = Message("calc.above-up-to", "above {low:.10g} up to {high:.10g}{unit}")
FROM_UP_TO = Message("calc.from-up-to", "from {low:.10g} up to {high:.10g}{unit}")


def range_text(quantity: MoveQuantity) -> str:
    """Permitted range, with the unit."""
    if quantity.choices:
        return ", ".join(map(str, quantity.choices))
    low, high = quantity.limits.low or 0.0, quantity.limits.high
    unit = f" {quantity.unit}".rstrip()
    if high is None:
        return (ABOVE if quantity.limits.is_low_excluded else FROM)(low=low, unit=unit)
    return (ABOVE_UP_TO if quantity.limits.is_low_excluded else FROM_UP_TO)(low=low, high=high, unit=unit)
