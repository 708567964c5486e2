"""The causes of what scripts do: conditions for which they waited."""

from __future__ import annotations

from functools import partial
from typing import Any

from steptwin.messages import Message, MessageText
from steptwin.simulation.logic.expression import parse_condition
from steptwin.simulation.script import steps as do
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, Place, covered, given, nothing
from steptwin.why.log import EndedWait
from steptwin.why.names import QuestionNames
from steptwin.why.roots import Act
from steptwin.why.sentences import SETS_A_FAULT, describe_input

SCRIPT = Message("why.script", "script {name}: {what}")
FROM_OUTSIDE = Message("why.from-outside", "from outside: {what}")
SCRIPT_WENT_ON = Message("why.script-went-on", "script {name} went on, as {condition} became true")


OF_DEVICES = (do.Set, do.Write, do.Send, do.Request)
"""Actions of scripts that stand for a device, such as a PLC. What a person does, or a test that sets faults, is from outside."""


class ScriptCauses:
    """Finds why scripts have acted. ``causes`` has the causes of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._names = QuestionNames(causes.log)

    def acted(self, act: Act, what: MessageText | None = None) -> Cause:
        """An action, which follows what its script waited for last, if it is one of `OF_DEVICES`. ``what``: as that of the
        function."""
        cause = acted(act, what)
        if not isinstance(act.what, OF_DEVICES):
            return cause
        wait = next(self._all.log.waits_before(act.by, act.time, act.order), None)
        if wait is None and self._waits(act.by):
            self._all.log.lack()
        # It is followed when the chain comes to it: some scripts wait for what they have done themselves.
        return cause if wait is None else cause._replace(before=partial(self._went_on, wait, act.by))

    def _went_on(self, wait: EndedWait, script: str) -> Cause:
        """The end of a wait, and what made its condition true."""
        place = Place(wait.time, wait.order)
        names = [self._names.canonical(name) for name in dict.fromkeys(parse_condition(wait.condition).names())]
        changed = self._all.changes.of(names, wait.time)
        if changed is not None and changed.link.time < wait.time:
            changed = covered(changed, changed.cover or Cover.MOTION)
        before = nothing if changed is None or changed.place >= place else partial(given, changed)
        text = SCRIPT_WENT_ON(name=script, condition=wait.condition)
        return Cause(ChainLink(wait.time, script, text), place, before, Cover.WAIT)

    def _waits(self, script: str) -> bool:
        """Whether a script of the description waits for a condition."""
        scripts = [one for one in self._all.log.world.spec.scripts if one.name == script]
        steps = (step for one in scripts for step in do.flat(one.steps))
        return any(one.when is not None for one in scripts) or any(isinstance(step, do.Until | do.UntilOver) for step in steps)


def acted(act: Act, what: MessageText | None = None) -> Cause:
    """An action for itself. ``what``: it in words, where its bytes have a meaning."""
    what = what or (describe_input(act.what) if not act.fault else SETS_A_FAULT(name=act.fault))
    text = SCRIPT(name=act.by, what=what) if act.by else FROM_OUTSIDE(what=what)
    return Cause(ChainLink(act.time, act.by or "outside", text, act), Place(act.time, act.order), nothing)
