"""Effect of a fault on a machine, judged from a run with it and the run without any."""

from __future__ import annotations

import enum
from collections.abc import Collection
from dataclasses import dataclass

from steptwin.campaign.case import EXPECTATIONS, WAITS, CaseResult, Verdict
from steptwin.campaign.description import MatrixRules
from steptwin.controller import SECOND, Nanos
from steptwin.files.world import World
from steptwin.motion.divisions import StepTrain
from steptwin.motion.profile import Profile
from steptwin.simulation.faults.active import FaultActs
from steptwin.simulation.scheduler.trace import TraceRecord

LATER = 0.01
"""A run is later if it exceeds the duration of the run without a fault by more than this share."""
COLLISION = "collision"


class FaultEffect(enum.StrEnum):
    """From the best to the worst. A run has the worst one that fits, but for a safe stop, which explains why nothing was made."""

    NEVER_ACTED = "never acted"
    UNAFFECTED = "unaffected"
    SAFE_STOP = "safe stop"
    HANGS = "hangs"
    WRONG_PART = "wrong part"
    UNSAFE = "unsafe"


@dataclass(frozen=True, slots=True)
class RunFacts:
    """Facts at the end of a run. ``alarm_ns``: when the alarm was there first; ``overdue``: the first wait of a script
    that ran out of time; ``acts``: how often the fault made a difference, and when; None: never."""

    result: CaseResult
    ended: str | None
    is_done: bool | None
    is_moving: bool
    collisions: int
    alarm_ns: Nanos | None
    has_alarm: bool
    overdue: tuple[Nanos, str] | None
    overdues: int
    acts: FaultActs | None


@dataclass(frozen=True, slots=True)
class Judgement:
    """``why``: in words; ``detection``: what noticed the fault; ``after_ns``: how long after it was set."""

    effect: FaultEffect
    why: str
    detection: str
    after_ns: Nanos | None


class FactsWatch:
    """Notes what is needed of a world from its beginning. Raises `Misuse` for conditions that are none of this world."""

    def __init__(self, world: World, rules: MatrixRules) -> None:
        self._world = world
        self._rules = rules
        self._alarm: Nanos | None = None
        for text in (rules.done, rules.alarm):
            if text is not None:
                world.condition(text)
        if rules.alarm is not None:
            world.when(rules.alarm, self._note, once=True, name="alarm")

    def _note(self) -> None:
        self._alarm = self._world.now

    def facts(self, result: CaseResult) -> RunFacts:
        """After the run."""
        world, rules = self._world, self._rules
        overdue = (world.overdue[0].time, str(world.overdue[0].value)) if len(world.overdue) else None
        return RunFacts(
            result,
            world.stopped,
            None if rules.done is None else world.holds(world.condition(rules.done)),
            _is_moving(world),
            sum(record.subject == COLLISION for record in world.trace.events()),
            self._alarm,
            rules.alarm is not None and world.holds(world.condition(rules.alarm)),
            overdue,
            len(world.overdue),
            next(iter(world.objects.faults.acts.values()), None),
        )


def _is_moving(world: World) -> bool:
    """Whether an axis moves at the end."""
    last: dict[tuple[str, str], TraceRecord] = {(record.controller, record.subject): record for record in world.trace.plans()}
    plans = (record.value.profile if isinstance(record.value, StepTrain) else record.value for record in last.values())
    return any(plan.moving(world.now) for plan in plans if isinstance(plan, Profile))


def wrong_without_a_fault(nominal: RunFacts, rules: MatrixRules) -> str:
    """The reason for which the run without a fault does not hold; empty if it does. What is wrong in it is wrong in every cell,
    so that none could tell what its fault did."""
    result = nominal.result
    found = [] if result.error is None else [f"it ends with an error: {_first_line(result.error)}"]
    found += [_said(verdict) for verdict in _failed(result).values()]
    if nominal.collisions:
        found.append(f"{nominal.collisions} collisions" if nominal.collisions > 1 else "a collision")
    if nominal.has_alarm:
        found.append(f"alarm = {rules.alarm!r} is true at its end")
    if nominal.is_done is False:
        found.append(f"done = {rules.done!r} is false at its end")
    return "; ".join(found)


def _first_line(text: str) -> str:
    return text.strip().partition("\n")[0]


def judge(
    facts: RunFacts, nominal: RunFacts, set_ns: Nanos, product: Collection[str] = (), made: Collection[str] = ()
) -> Judgement:
    """The effect of a fault that was set at a moment; the run without it holds. ``product``: as in `MatrixRules`; ``made``: the
    measures that tell what was made, while those of moments and cycle times tell only how late."""
    detection, noticed = _detection(facts, nominal)
    after = None if noticed is None else max(noticed - set_ns, 0)
    effect, why = _effect(facts, nominal, frozenset(product), made)
    return Judgement(effect, why, detection, after)


def _effect(facts: RunFacts, nominal: RunFacts, product: frozenset[str], made: Collection[str]) -> tuple[FaultEffect, str]:
    result = facts.result
    if result.error is not None:
        return FaultEffect.UNSAFE, f"the run ended with an error: {_first_line(result.error)}"
    wrong = _failed(result)
    expected = wrong.pop(EXPECTATIONS, None)
    wrong.pop(WAITS, None)  # that something was missing is judged by what became of it, below
    unsafe = [verdict for name, verdict in wrong.items() if name not in product]
    if unsafe:
        return FaultEffect.UNSAFE, "; ".join(_said(verdict) for verdict in unsafe)
    if facts.collisions:
        return FaultEffect.UNSAFE, "a collision"
    if facts.has_alarm:
        return (
            (FaultEffect.HANGS, "an alarm, but an axis moves at the end")
            if facts.is_moving
            else (FaultEffect.SAFE_STOP, "an alarm")
        )
    missing = _missing(facts, nominal)
    if missing and facts.is_moving:
        return FaultEffect.HANGS, f"{missing}; an axis moves at the end"
    if missing and facts.overdues > nominal.overdues:
        return FaultEffect.SAFE_STOP, f"{missing}; everything stands, and a script noticed"
    if missing:
        return FaultEffect.HANGS, f"{missing}; everything stands, and nothing noticed"
    different = [_said(verdict) for verdict in wrong.values()]
    different += [f"expected {expected.why}"] if expected is not None else []
    different += [
        f"{name} is {value:g} instead of {nominal.result.measures.get(name, float('nan')):g}"
        for name, value in result.measures.items()
        if name in made and value != nominal.result.measures.get(name)
    ]
    if different:
        return FaultEffect.WRONG_PART, "; ".join(different)
    return FaultEffect.NEVER_ACTED if facts.acts is None else FaultEffect.UNAFFECTED, _later(facts, nominal)


def _failed(result: CaseResult) -> dict[str, Verdict]:
    return {verdict.name: verdict for verdict in result.verdicts if not verdict.holds}


def _said(verdict: Verdict) -> str:
    return f"{verdict.name}: {verdict.why}" if verdict.why else verdict.name


def _missing(facts: RunFacts, nominal: RunFacts) -> str:
    """Reason for which the run did not make its parts; empty if there is none."""
    if facts.is_done is not None:
        return "" if facts.is_done else "not done"
    if facts.overdues > nominal.overdues and facts.overdue is not None:
        return facts.overdue[1]
    if facts.ended != nominal.ended:
        return f"not ended by {nominal.ended!r}"
    return ""


def _detection(facts: RunFacts, nominal: RunFacts) -> tuple[str, Nanos | None]:
    """The first that noticed the fault, and the moment."""
    found: list[tuple[Nanos, str]] = []
    if facts.alarm_ns is not None and nominal.alarm_ns is None:
        found.append((facts.alarm_ns, "alarm"))
    if facts.overdue is not None and facts.overdues > nominal.overdues:
        found.append((facts.overdue[0], "wait of a script"))
    expected = _failed(facts.result).get(EXPECTATIONS)
    if expected is not None and expected.at_ns is not None:
        found.append((expected.at_ns, "expectation of a script"))
    if not found:
        return "", None
    at, what = min(found)
    return what, at


def _later(facts: RunFacts, nominal: RunFacts) -> str:
    late = facts.result.end_ns - nominal.result.end_ns
    if facts.ended is None or late <= LATER * nominal.result.end_ns:
        return ""
    return f"{late / SECOND:.3g} s later"
