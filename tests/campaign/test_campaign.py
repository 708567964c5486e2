"""Whole campaigns: the same results wherever and in whatever order cases run, and after whatever ended."""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from campaigns import CAMPAIGN, campaign_file
from tests.conftest import until

from steptwin.campaign import execution
from steptwin.campaign.batches import Workers, run_batch
from steptwin.campaign.campaign import RESULTS, SUMMARY, Campaign, CampaignProgress
from steptwin.campaign.case import Case
from steptwin.campaign.execution import CaseExecution
from steptwin.campaign.results import StoredCase
from steptwin.campaign.runner import CaseRunner
from steptwin.campaign.workers import LOCAL, workers
from steptwin.errors import LineFailure, Misuse
from steptwin.files.world import World


@pytest.fixture
def doors(tmp_path: Path) -> Campaign:
    return Campaign.load(campaign_file(tmp_path))


def test_half_of_the_runs_fail(doors: Campaign) -> None:
    summary = doors.run()
    early = [n for n in range(40) if float(doors.cases[n].values["t"]) <= 1.0]
    assert (summary.runs, summary.failed) == (40, len(early))
    assert [one.number for one in summary.failures] == early
    assert summary.failures[0].why == "expectations of the scripts: table.IN1 == 0; table.IN1 is 1"


@pytest.mark.parametrize(("jobs", "dask"), [(2, None), (2, LOCAL)])
def test_results_are_the_same_with_any_workers(doors: Campaign, jobs: int, dask: str | None) -> None:
    if dask is not None:
        pytest.importorskip("distributed")
    assert doors.run(jobs=jobs, dask=dask).to_json() == doors.run(jobs=1).to_json()


class _Shuffled(Executor):
    """Runs tasks late and in another order; from time to time all that it has are lost with it."""

    def __init__(self, seed: int, losses: int = 0) -> None:
        self._chance = random.Random(seed)
        self._losses = losses
        self._waiting: list[tuple[Future[Any], Callable[[], Any]]] = []
        self.most = 0
        """Tasks at a time."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self._waiting.append((future, lambda: fn(*args, **kwargs)))
        self.most = max(self.most, len(self._waiting))
        if len(self._waiting) == 4:
            self.work()
        return future

    def work(self) -> None:
        self._chance.shuffle(self._waiting)
        if self._losses:
            self._losses -= 1
            for future, _ in self._waiting:
                future.set_exception(BrokenExecutor("lost"))
        else:
            for future, act in self._waiting:
                future.set_result(act())
        self._waiting.clear()


@pytest.mark.parametrize(("seed", "losses"), [(1, 0), (2, 0), (3, 1), (4, 2)])
def test_results_are_the_same_in_any_order_and_after_losses(
    doors: Campaign, seed: int, losses: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execution, "TASK_S", 0.0)  # a case for each task, however fast this computer is
    there = _Shuffled(seed, losses)
    numbers: list[int] = []
    found: dict[int, Any] = {}
    cases = iter([doors.cases[n] for n in range(37)])
    # Four tasks wait at a time; the last ones are fewer, and work when they are asked for.
    running = CaseExecution(doors.description, Workers(lambda: there, 2), cases, lambda: False)
    for done in _pushed(running, there):
        numbers += [case.number for case in done.cases]
        found |= {result.number: result for result in done.results}
    assert sorted(numbers) == list(range(37))
    assert numbers != sorted(numbers)
    assert [found[n] for n in range(37)] == [doors.run_case(n) for n in range(37)]
    assert there.most <= 4


def _pushed(execution: CaseExecution, there: _Shuffled) -> Iterator[Any]:
    fill = execution._fill

    def filled() -> None:
        fill()
        there.work()

    execution._fill = filled  # type: ignore[method-assign]
    yield from execution


class _Deadly(Executor):
    """Is lost whenever it is given a certain case."""

    def __init__(self, deadly: int, lost: list[Sequence[int]]) -> None:
        self._deadly = deadly
        self._lost = lost

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        numbers = [case.number for case in args[1]]
        if self._deadly in numbers:
            self._lost.append(numbers)
            future.set_exception(BrokenExecutor("lost"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_a_case_that_ends_its_process_each_time_is_an_error_of_this_case_only(doors: Campaign) -> None:
    lost: list[Sequence[int]] = []
    cases = iter([doors.cases[n] for n in range(20)])
    execution = CaseExecution(doors.description, Workers(lambda: _Deadly(13, lost), 2), cases, lambda: False)
    found = {result.number: result for done in execution for result in done.results}
    assert sorted(found) == list(range(20))
    assert [n for n, result in found.items() if result.error is not None] == [13]
    assert found[13].error == "the process that ran it was lost each time"
    assert lost[-1] == [13]


def test_a_process_of_the_pool_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    campaign = Campaign.load(campaign_file(tmp_path, CAMPAIGN.replace("runs = 40", "runs = 200")))
    killed: list[int] = []

    def kill(progress: CampaignProgress) -> None:
        if not killed and progress.done >= 5:
            killed.append(_child())
            os.kill(killed[0], signal.SIGKILL)

    summary = campaign.run(jobs=2, progress=kill)
    assert killed
    assert summary.to_json() == campaign.run().to_json()
    assert summary.errors == 0


def _child() -> int:
    """A process of a pool."""
    from multiprocessing import active_children

    return next(one.pid for one in active_children() if one.pid is not None)


def test_a_worker_of_dask_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    campaign = Campaign.load(campaign_file(tmp_path, CAMPAIGN.replace("runs = 40", "runs = 300")))
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None)
    with cluster:
        killed: list[int] = []

        def kill(progress: CampaignProgress) -> None:
            if not killed and progress.done >= 5:
                killed.append(next(iter(cluster.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)

        summary = campaign.run(dask=cluster.scheduler_address, progress=kill)
    assert killed
    assert summary.to_json() == campaign.run().to_json()


def test_a_cluster_that_is_not_there(doors: Campaign) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(LineFailure, match="no cluster of Dask with a worker at nonsense"):
        doors.run(dask="nonsense")


# ---------------------------------------------------------------------- stores


def test_what_is_done_is_not_done_again(doors: Campaign, tmp_path: Path) -> None:
    first = doors.changed(runs=25).run(tmp_path / "out")
    done: list[int] = []
    summary = doors.run(tmp_path / "out", progress=lambda progress: done.append(progress.done))
    assert first.runs == 25
    assert done[0] == 26  # the first further one
    assert summary.to_json() == doors.run().to_json()
    assert json.loads((tmp_path / "out" / SUMMARY).read_text()) == json.loads(json.dumps(summary.to_json()))


def test_a_campaign_that_was_killed_goes_on(tmp_path: Path) -> None:
    path = campaign_file(tmp_path, CAMPAIGN.replace("runs = 40", "runs = 3000"))
    out = tmp_path / "out"
    command = [sys.executable, "-m", "steptwin", "campaign", "run", str(path), "--jobs", "1", "--out", str(out)]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    campaign = Campaign.load(path)
    try:
        until(lambda: _stored(out) > 5, "some results", 100.0)
    finally:
        running.kill()
        running.wait()
    known = _stored(out)
    assert known < 3000
    few = campaign.changed(runs=known + 20)
    summary = few.run(out)
    assert summary.to_json() == few.run().to_json()


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="processes are found in /proc")
def test_an_interrupt_is_for_the_first_process_alone_also_while_the_others_begin(tmp_path: Path) -> None:
    """Ctrl-C on a terminal goes to all of them."""
    path = campaign_file(tmp_path, CAMPAIGN.replace("runs = 40", "runs = 3000"))
    out = tmp_path / "out"
    command = [sys.executable, "-m", "steptwin", "campaign", "run", str(path), "--jobs", "2", "--out", str(out)]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    children = Path(f"/proc/{running.pid}/task/{running.pid}/children")

    def has_results() -> bool:
        for child in children.read_text().split():
            os.kill(int(child), signal.SIGINT)
        return _stored(out) > 5

    try:
        until(has_results, "some results", 100.0)
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=100)
    finally:
        running.kill()
        running.wait()
    assert (running.returncode, errors) == (130, "")


def _stored(out: Path) -> int:
    """How many cases have results; it only looks, so that it is in nobody's way."""
    try:
        with closing(sqlite3.connect(f"file:{out / RESULTS}?mode=ro", uri=True)) as connection:
            return int(connection.execute("SELECT count(*) FROM campaign_case").fetchone()[0])
    except sqlite3.OperationalError:  # there is no file or table yet
        return 0


def test_a_changed_campaign_needs_another_folder(doors: Campaign, tmp_path: Path) -> None:
    doors.changed(runs=1).run(tmp_path / "out")
    with pytest.raises(Misuse, match="has the results of another campaign, or of this one before a change: give another --out"):
        doors.changed(seed=8).run(tmp_path / "out")


def test_an_end_by_failure_is_the_same_with_any_workers(doors: Campaign) -> None:
    first = next(n for n in range(40) if float(doors.cases[n].values["t"]) <= 1.0)
    stopping = doors.changed(until_failure=True)
    for jobs in (1, 2):
        summary = stopping.run(jobs=jobs)
        assert (summary.runs, summary.failed) == (first + 1, 1)


def test_a_campaign_that_ended_by_failure_has_ended(doors: Campaign, tmp_path: Path) -> None:
    stopping = doors.changed(until_failure=True)
    one = stopping.run(tmp_path / "out")
    done: list[CampaignProgress] = []
    assert stopping.run(tmp_path / "out", progress=done.append).to_json() == one.to_json()
    assert done == []


def test_time_ends_a_campaign_without_gaps(tmp_path: Path) -> None:
    text = CAMPAIGN.replace("runs = 40", 'time = "300 ms"')
    campaign = Campaign.load(campaign_file(tmp_path, text))
    assert campaign.cases.count is None
    summary = campaign.run(tmp_path / "out")
    assert summary.runs >= 1
    store = campaign.open_store(tmp_path / "out")
    assert list(store.numbers()) == list(range(summary.runs))
    store.close()


def test_coverage_is_added_up_and_survives(tmp_path: Path) -> None:
    (tmp_path / "loop.prg").write_text("LOOP:\nDELAY 0.1\nJUMP LOOP\n")
    world = '[[mic488]]\nname = "table"\nprogram = "loop.prg"\nstart = true\n'
    text = '[campaign]\nworld = "world.toml"\nend = "1 s"\nruns = 6\n'
    campaign = Campaign.load(campaign_file(tmp_path, text, world))
    campaign.changed(runs=4).run(tmp_path / "out", coverage=True)
    campaign.run(tmp_path / "out", coverage=True)
    whole = Campaign(campaign.description)
    whole.run(coverage=True, jobs=2)
    assert campaign.covered == whole.covered == 6
    assert campaign.coverage.to_json() == whole.coverage.to_json()


@pytest.mark.parametrize(
    ("options", "message"), [({"runs": 0}, "runs 0"), ({"seed": -1}, "seed -1"), ({"time": "x"}, "'x' is not a")]
)
def test_what_is_changed_is_checked(doors: Campaign, options: dict[str, Any], message: str) -> None:
    with pytest.raises(Misuse, match=message):
        doors.changed(**options)


@pytest.mark.parametrize("jobs", [0, 1025])
def test_jobs_are_bounded(jobs: int) -> None:
    with pytest.raises(Misuse, match="permitted are 1 to 1024"), workers(jobs, None):
        pass


def test_a_script_without_a_guard_is_told_so(tmp_path: Path) -> None:
    path = campaign_file(tmp_path)
    script = tmp_path / "unguarded.py"
    script.write_text(f"from steptwin.campaign.campaign import Campaign\nCampaign.load({str(path)!r}).run(jobs=2)\n")
    found = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=False)
    assert "needs 'if __name__ == \"__main__\":' around what it does" in found.stderr


def test_a_batch_is_repeatable_and_pickles(doors: Campaign) -> None:
    import pickle

    description, cases = pickle.loads(pickle.dumps((doors.description, [doors.cases[n] for n in range(3)])))
    assert run_batch(description, cases, counts=False).results == tuple(doors.run_case(n) for n in range(3))


def test_what_the_file_leaves_open_is_given_with_the_call(tmp_path: Path) -> None:
    text = CAMPAIGN.replace("runs = 40\n", "")
    campaign = Campaign.load(campaign_file(tmp_path, text))
    with pytest.raises(Misuse, match="campaign 'doors' has no end: give runs, time, until_failure or a grid"):
        campaign.run(tmp_path / "results")
    assert not (tmp_path / "results").exists()
    assert campaign.changed(runs=3).run().runs == 3
    assert campaign.changed(until_failure=True).run().failed == 1
    hypercube = Campaign.load(campaign_file(tmp_path, text.replace("seed = 7", 'design = "latin-hypercube"')))
    assert hypercube.changed(runs=4).run().runs == 4


def test_a_campaign_that_was_killed_before_its_first_failure_was_sure_fills_the_gaps(doors: Campaign, tmp_path: Path) -> None:
    """Another process had a later failing case done, and one before it not."""
    failing = [n for n in range(40) if float(doors.cases[n].values["t"]) <= 1.0]
    stopping = doors.changed(until_failure=True)
    store = stopping.open_store(tmp_path / "out")
    store.add([StoredCase(doors.cases[failing[1]], doors.run_case(failing[1]))])
    store.close()
    seen: list[CampaignProgress] = []
    assert stopping.run(tmp_path / "out", progress=seen.append).to_json() == stopping.run().to_json()
    assert seen[-1].failed == 2  # with the one that was known


def test_a_mistake_in_the_twin_is_an_error_of_one_run(doors: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    begin = CaseRunner.begin

    def faulty(self: CaseRunner, case: Case, *, keep: bool = False) -> World:
        return begin(self, case, keep=keep) if case.number != 3 else _divide()

    monkeypatch.setattr(CaseRunner, "begin", faulty)
    summary = doors.run()
    assert (summary.runs, summary.errors) == (40, 1)
    why = next(one.why for one in summary.failures if one.number == 3)
    assert why == "steptwin itself failed: ZeroDivisionError: division by zero (test_campaign.py, _divide)"


def _divide() -> World:
    raise ZeroDivisionError("division by zero")
