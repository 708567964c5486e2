"""Every single fault that the world can have, at every moment and occasion of a run without one: every byte and request of a
line, every edge of an input, every statement, edge and motion that begins."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace
from functools import cached_property
from itertools import accumulate

from steptwin.campaign.case import Case, FaultAt
from steptwin.campaign.cases import Cases
from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.inventory import PossibleFault, occasions, possible_faults
from steptwin.campaign.runner import CaseRunner
from steptwin.campaign.shrink import ADDED
from steptwin.controller import Nanos
from steptwin.simulation.faults import Fault
from steptwin.simulation.kinds.programs import StatementSubscription
from steptwin.simulation.scheduler.trace import TraceRecord

_MOMENTS = frozenset({"edge", "plan", "statement"})


def without_faults(description: CampaignDescription) -> Case:
    """The case with the values of the world's description, and the middle of what has none there; with all steps."""
    values = {one.name: one.spread.value(0.5) for one in description.vary if not one.is_path}
    return Cases(description).made(0, description.seed, values, [])


class ExhaustiveCases:
    """Cases of a description, by number from 0. Its own faults and values that vary are left out; its steps are done."""

    def __init__(self, description: CampaignDescription) -> None:
        self.description = description
        self._nominal = without_faults(description)

    def __getitem__(self, number: int) -> Case:
        row = bisect_right(self._ends, number)
        place = number - (self._ends[row - 1] if row else 0)
        possible, moments, _ = self._rows[row]
        fault: Fault = possible.once(place + 1) if possible.is_counted else possible.fault
        at = self._begin if possible.is_counted else moments[place]
        return replace(self._nominal, number=number, faults=(FaultAt(at, str(fault), ADDED),))

    @property
    def count(self) -> int:
        return self._ends[-1] if self._ends else 0

    @property
    def _begin(self) -> Nanos:
        return self.description.start_ns or 0

    @cached_property
    def _rows(self) -> list[tuple[PossibleFault, tuple[Nanos, ...], int]]:
        """Each fault with its moments, and how many cases it has."""
        description, runner = self.description, CaseRunner(self.description)
        found: set[Nanos] = {self._begin}

        def note(record: TraceRecord) -> None:
            if record.kind in _MOMENTS and record.time >= self._begin:
                found.add(record.time)

        world = runner.begin(self._nominal)
        world.trace.subscribers.append(note)
        subscriber = StatementSubscription(world.programs, note)
        world.run_to(self._nominal.end_ns, description.until)
        subscriber.close()
        moments = tuple(sorted(found))
        possible = possible_faults(runner.begin(self._nominal))
        counts = occasions(runner.begin(self._nominal), possible, self._nominal.end_ns, description.until)
        rows = [(one, moments, counts[one.text] if one.is_counted else len(moments)) for one in possible]
        return [row for row in rows if row[2]]

    @cached_property
    def _ends(self) -> list[int]:
        return list(accumulate(count for _, _, count in self._rows))
