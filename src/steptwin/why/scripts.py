"""The causes of what scripts do: conditions for which they waited."""

from __future__ import annotations

from functools import partial
from typing import Any

from steptwin.messages import Message, MessageText
from steptwin.simulation.logic.expression import parse_condition
from steptwin.simulation.script import steps as do
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, FoundCause, Place, given, nothing
from steptwin.why.log import EndedWait
from steptwin.why.names import QuestionNames
from steptwin.why.roots import Act
from steptwin.why.sentences import SETS_A_FAULT, describe_input

SCRIPT = Message("why.script", "script {name}: {what}")
FROM_OUTSIDE = Message("why.from-outside", "from outside: {what}")
SCRIPT_WENT_ON = Message("why.script-went-on", "script {name} went on, as {condition} became true")


class ScriptCauses:
    """Finds why scripts have acted. ``causes`` has the causes of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._names = QuestionNames(causes.log)

    def acted(self, act: Act, what: MessageText | None = None) -> Cause:
        """An action, which follows what its script waited for last. Where faults are set and cleared that is of the test, not of
        the machine. ``what``: as that of the function."""
        cause = acted(act, what)
        ended = None if act.fault or isinstance(act.what, do.ClearFault) else self._wait_before(act)
        return cause if ended is None else cause._replace(before=partial(given, ended))

    def _wait_before(self, act: Act) -> FoundCause:
        """The last wait of its script that something has ended."""
        for wait in self._all.log.waits_before(act.by, act.time, act.order):
            changed = self._changed(wait)
            if changed is not None and changed.place < (wait.time, wait.order, 0):
                text = SCRIPT_WENT_ON(name=act.by, condition=wait.condition)
                link, place = ChainLink(wait.time, act.by, text), Place(wait.time, wait.order)
                return Cause(link, place, partial(given, changed), Cover.WAIT)
        if self._waits(act.by):
            self._all.log.lack()
        return None

    def _changed(self, wait: EndedWait) -> FoundCause:
        names = [self._names.canonical(name) for name in dict.fromkeys(parse_condition(wait.condition).names())]
        return self._all.changes.of(names, wait.time)

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
