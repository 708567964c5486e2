"""A campaign from Python.

campaign = Campaign.load("campaign.toml")
summary = campaign.run("results", jobs=2)
print(summary.failed, "of", summary.runs, [one.number for one in summary.failures])
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from steptwin.campaign.batches import HERE, Workers
from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.cases import Cases
from steptwin.campaign.description import SEARCHES, CampaignDescription
from steptwin.campaign.execution import CaseExecution, Done
from steptwin.campaign.reading import load_campaign, read_campaign
from steptwin.campaign.results import MemoryStore, ResultStore, StoredCase, gaps
from steptwin.campaign.runner import CaseRunner
from steptwin.campaign.search.exhaustive import ExhaustiveCases, without_faults
from steptwin.campaign.search.guided import WAVE, GuidedSearch, distance
from steptwin.campaign.summary import CampaignSummary
from steptwin.controller import SECOND
from steptwin.coverage.counts import Coverage
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.extras import missing
from steptwin.files.textfiles import write_bytes
from steptwin.files.world import World

if TYPE_CHECKING:
    from collections.abc import Generator

RESULTS, SUMMARY = "results.db", "summary.json"
SUFFIX = ".results"
"""Suffix of the folder of results beside the file of a campaign."""
"""Files in the folder of the results."""


class CampaignProgress(NamedTuple):
    """``total``: None if it is unknown. ``rate``: runs per second of the wall, since the begin."""

    done: int
    failed: int
    total: int | None
    rate: float


def _unwatched(_: CampaignProgress) -> None:
    """No progress is shown."""


class Campaign:
    """Many runs of one world, and what must hold in all of them. The same cases, results and digest wherever they run."""

    def __init__(self, description: CampaignDescription) -> None:
        self.description = description
        self.cases = Cases(description)
        """By number, from 0, but those of other searches than random."""
        self._chosen = ExhaustiveCases(description) if description.search == "exhaustive" else self.cases
        self.covered = 0
        """In how many runs what programs execute was counted."""
        self.coverage = Coverage()
        """Statements that they executed, after a `run` that counts them."""
        self.memory: MemoryStore | None = None
        """Where results are kept instead of in a folder."""
        self._runner: CaseRunner | None = None

    @classmethod
    def load(cls, path: str | Path) -> Campaign:
        """The campaign that a file describes. Raises `WorldError` (a `Misuse`) with everything that is wrong with it."""
        return cls(load_campaign(path))

    @classmethod
    def from_toml(cls, text: str, folder: str | Path = ".", name: str = "campaign.toml") -> Campaign:
        """The campaign that a text describes, whose world lies in a folder. Raises `WorldError`."""
        return cls(read_campaign(name, text, Path(folder)))

    def changed(
        self,
        *,
        runs: int | None = None,
        seed: int | None = None,
        time: float | str | None = None,
        until_failure: bool | None = None,
        search: str | None = None,
    ) -> Campaign:
        """The same with another seed or search, or of another extent. Raises `Misuse`."""
        description = self.description
        if search is not None and search not in SEARCHES:
            raise Misuse(f"search {search!r}: permitted are {', '.join(SEARCHES)}")
        if runs is not None and runs < 1:
            raise Misuse(f"runs {runs}: must be 1 or more")
        if seed is not None and not 0 <= seed < 1 << 63:
            raise Misuse(f"seed {seed}: permitted are whole numbers from 0 to {(1 << 63) - 1}")
        time_ns = description.time_ns if time is None else duration(time)
        return Campaign(
            replace(
                description,
                runs=description.runs if runs is None else runs,
                seed=description.seed if seed is None else seed,
                time_ns=time_ns,
                until_failure=description.until_failure if until_failure is None else until_failure,
                search=description.search if search is None else search,
            )
        )

    @property
    def count(self) -> int | None:
        """How many cases there are; None: without end. Raises `Misuse` where nothing says when to end."""
        return self._chosen.count

    # ------------------------------------------------------------------ single runs

    @property
    def runner(self) -> CaseRunner:
        """Runs single cases in this process."""
        if self._runner is None:
            self._runner = CaseRunner(self.description)
        return self._runner

    def run_case(self, case: Case | int) -> CaseResult:
        """The result of a case, or of that with a number."""
        return self.runner.run(case if isinstance(case, Case) else self._chosen[case])

    def world(self, case: Case | int) -> World:
        """The world of a case before it begins to vary, with its trace and recording: ``run`` it as long as you like."""
        return self.runner.begin(case if isinstance(case, Case) else self._chosen[case], keep=True)

    def units(self) -> dict[str, str]:
        """The unit of each measure by its name; empty where it has none."""
        measures = self.description.measures
        world = self.world(without_faults(self.description)) if any(one.value is not None for one in measures) else None
        return {one.name: "s" if world is None or one.value is None else world.signal(one.value).unit for one in measures}

    # ------------------------------------------------------------------ all of them

    def run(
        self,
        out: str | Path | None = None,
        *,
        jobs: int | None = 1,
        dask: str | None = None,
        coverage: bool = False,
        progress: Callable[[CampaignProgress], object] = _unwatched,
    ) -> CampaignSummary:
        """Run all cases that have no results yet; the results go to the folder ``out``, or are not kept.

        ``jobs``: processes (None: one for each processor); ``dask``: the address of a cluster, or ``"local"``. ``coverage``:
        count what programs execute. Raises `Misuse`, and `LineFailure` for a database or cluster that fails. Once interrupted,
        the same call goes on where it was.
        """
        total = self.count
        with self._store(out) as store, _workers(jobs, dask) as there:
            summary = self._run(store, there, total, coverage=coverage, progress=progress)
            if coverage:
                self.coverage, self.covered = store.coverage()
        if out is not None:
            write_bytes(Path(out) / SUMMARY, (json.dumps(summary.to_json(), ensure_ascii=False, indent=1) + "\n").encode())
        return summary

    @contextmanager
    def _store(self, out: str | Path | None) -> Generator[ResultStore]:
        store = self.open_store(out)
        try:
            yield store
        finally:
            store.close()

    def open_store(self, out: str | Path | None) -> ResultStore:
        """The results in a folder, in the database that the description names, or, without either, in memory. To be closed."""
        if self.memory is not None:
            return self.memory
        if out is None and self.description.database is None:
            return MemoryStore()
        try:
            from sqlalchemy.engine import URL

            from steptwin.campaign.store import CampaignStore
            from steptwin.history.database import SQLITE, read_url
        except ImportError:
            raise missing("a campaign", "campaign") from None
        folder = None if out is None else Path(out)
        if folder is not None:
            _make_folder(folder)
        if self.description.database is not None:
            url = read_url(self.description.database, folder or Path())
        else:
            url = URL.create(SQLITE, database=str((folder or Path()) / RESULTS))
        description = self.description
        is_own = self.description.database is None
        return CampaignStore(url, description.digest, description.name, description.seed, is_own=is_own)

    def _run(
        self,
        store: ResultStore,
        there: Workers,
        total: int | None,
        *,
        coverage: bool,
        progress: Callable[[CampaignProgress], object],
    ) -> CampaignSummary:
        description = self.description
        first = store.first_failure() if description.until_failure else None
        done = store.numbers()
        known, failed = len(done), store.failed()
        began = time.monotonic()
        counted = store.coverage()[0] if coverage else None

        def is_over() -> bool:
            return description.time_ns is not None and (time.monotonic() - began) * SECOND >= description.time_ns

        def is_wanted(number: int) -> bool:
            """Until the first failure all before it are, also such as another process left out when it was ended."""
            return first is None or not description.until_failure or number < first

        finished = 0
        if description.search == "guided":
            told = {case.number: distance(result) for case, result in store.results()}
            batches = self._guided(there, told, is_wanted, is_over, counts=coverage)
        else:
            cases = (self._chosen[number] for number in takewhile(is_wanted, gaps(done, total)))
            batches = iter(CaseExecution(description, there, cases, is_over, counts=coverage))
        for batch in batches:
            if counted is not None:
                for text in Coverage.from_json(batch.coverage or ()):
                    counted.add(text)
            store.add([StoredCase(*both) for both in zip(batch.cases, batch.results, strict=True)], counted)
            wrong = [one.number for one in batch.results if one.failed]
            failed += len(wrong)
            first = min(wrong, default=None) if first is None else min((first, *wrong))
            finished += len(batch.results)
            progress(CampaignProgress(known + finished, failed, total, finished / max(time.monotonic() - began, 1e-9)))
        before = total if first is None or not description.until_failure else first + 1
        summary = CampaignSummary.of(description.name, description.digest, description.seed, store.results(before))
        summary.times = description.times
        return summary

    def _guided(
        self,
        there: Workers,
        known: dict[int, float],
        is_wanted: Callable[[int], bool],
        is_over: Callable[[], bool],
        *,
        counts: bool,
    ) -> Iterator[Done]:
        """Runs waves of cases; ``known`` are the distances of those that ran before, by number."""
        search, left = GuidedSearch(self.cases), self.cases.count
        while left is None or left > 0:
            wave = search.ask(WAVE if left is None else min(WAVE, left))
            unknown = (case for case in wave if case.number not in known and is_wanted(case.number))
            for batch in CaseExecution(self.description, there, unknown, is_over, counts=counts):
                known.update((result.number, distance(result)) for result in batch.results)
                yield batch
            if any(case.number not in known for case in wave):
                return
            search.tell([known[case.number] for case in wave])
            left = None if left is None else left - len(wave)


@contextmanager
def _workers(jobs: int | None, dask: str | None) -> Generator[Workers]:
    if jobs == 1 and dask is None:
        yield HERE
        return
    from steptwin.campaign.workers import workers

    with workers(jobs, dask) as found:
        yield found


def _make_folder(folder: Path) -> None:
    from steptwin.system import reason

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Misuse(f"--out {folder}: {reason(error)}") from None
