"""The campaign of a page: the twin's worker wants it, the jobs' worker runs it, and the page hands over what they say."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from steptwin.campaign.campaign import Campaign
from steptwin.errors import Misuse, Refusal
from steptwin.inpage.campaigns import CAMPAIGN, PageCampaigns
from steptwin.inpage.jobs import MOST_RUNS, PageJobs
from steptwin.studio.campaignrequests import CampaignState

WORLD = """
[[mic488]]
name = "table"
[[axis]]
name = "x"
drive = "table.M1"
travel = [0.0, 100.0]
"""
TEXT = """
[campaign]
world = "hall.toml"
runs = 6
end = "1 s"
[[vary]]
name = "level"
between = [0.0, 1.0]
[[step]]
at = "0.5 s"
do = { set = { "table.AIN1" = "{level}" } }
[[property]]
name = "low"
always = "table.AIN1 < 0.5"
[[measure]]
name = "reading"
value = "table.AIN1"
"""


class Page:
    """Both workers and what is between them. A job runs when `work` lets it; ``most``: news until its worker is killed."""

    def __init__(self, text: str = TEXT) -> None:
        self.machine = {"hall.toml": WORLD.encode()}
        self.campaigns = PageCampaigns(self, text, lambda: self.machine)
        self.job: Any = None
        self.ended = 0
        self.news: list[Any] = []
        self.files: Mapping[str, bytes] = {}
        self.most = -1

    def runJob(self, job: Mapping[str, object]) -> None:  # noqa: N802  as the page names it
        self.job = job

    def endJob(self) -> None:  # noqa: N802
        self.ended += 1
        self.job = None

    def tell(self, news: str, files: Mapping[str, bytes]) -> None:
        if len(self.news) == self.most:
            raise KeyboardInterrupt
        self.news.append(json.loads(news))
        self.files = files
        self.campaigns.take(news)

    def work(self) -> None:
        PageJobs(self).run(**self.job)

    @property
    def state(self) -> CampaignState:
        (state,) = asyncio.run(self.campaigns.list())
        return state

    def run(self) -> None:
        asyncio.run(self.campaigns.run(CAMPAIGN))

    def change(self, text: str | None) -> None:
        asyncio.run(self.campaigns.change(CAMPAIGN, text))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_campaign_has_the_results_that_it_has_on_a_computer(folder: Path) -> None:
    page = Page()
    page.run()
    assert page.state.is_running
    page.work()
    state, result = page.state, page.state.result
    assert result is not None
    assert (state.is_running, state.done, state.total, state.error) == (False, 6, 6, None)
    assert 0 < result.failed == state.failed < 6
    assert [one.failed for one in result.properties] == [result.failed]
    assert page.news[-1]["report"]["digest"] == Campaign.load(folder / CAMPAIGN).run().digest
    named = {"report.html", *(one for cause in result.causes for one in (cause.recording, cause.timeline) if one)}
    assert len(named) == 3
    assert {f"{state.results}/{name}" for name in named} <= set(page.files)
    assert b"href" not in page.files["campaign.results/report.html"]


def test_one_that_was_killed_goes_on_where_it_was_and_a_change_begins_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steptwin.campaign.execution.MOST_CASES", 2)
    page = Page()
    page.most = 2
    page.run()
    with pytest.raises(Refusal, match="one campaign at a time"):
        page.change(TEXT)
    with pytest.raises(KeyboardInterrupt):
        page.work()
    asyncio.run(page.campaigns.end(CAMPAIGN))
    done = page.state.done
    assert page.ended == 1
    assert (page.state.is_running, page.state.result, 0 < done < 6) == (False, None, True)
    page.campaigns.take('{"error": "of the one that was killed"}')
    assert page.state.error is None

    page.most = -1
    page.run()
    assert len(page.job["known"]) == done
    page.work()
    assert page.state.done == 6

    page.machine = {"hall.toml": f"{WORLD}# changed\n".encode()}
    page.run()
    assert (page.job["known"], page.state.done, page.state.result) == ([], 0, None)
    page.work()
    page.change(TEXT.replace("runs = 6", "runs = 7"))
    assert (page.state.total, page.state.done, page.state.result) == (7, 0, None)
    page.change(None)
    assert (page.state.total, page.state.text) == (6, TEXT)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TEXT.replace("runs = 6", f"runs = {MOST_RUNS + 1}"), f"a page runs at most {MOST_RUNS}"),
        (TEXT.replace("runs = 6", "until_failure = true"), "runs: not given"),
        (TEXT.replace("runs = 6", 'runs = 6\ndesign = "sobol"'), 'design = "sobol": a page has no library'),
        (TEXT.replace("runs = 6", 'runs = 6\nsearch = "guided"'), 'search = "guided": a page has no library'),
        (TEXT.replace("runs = 6", 'runs = 6\ndatabase = "sqlite:///r.db"'), "a page reaches none"),
        (TEXT.replace("table.AIN1 <", "table.nonsense <"), f"{CAMPAIGN}:"),
        (TEXT.replace("hall.toml", "other.toml"), "other.toml"),
        ("[campaign", CAMPAIGN),
    ],
)
def test_what_a_page_cannot_run_is_refused_with_words(text: str, words: str) -> None:
    page = Page(text)
    page.run()
    page.work()
    assert words in str(page.state.error)
    assert (page.state.is_running, page.state.done) == (False, 0)


def test_there_is_one_campaign_of_a_page() -> None:
    with pytest.raises(Misuse, match=r"no campaign 'x': there are campaign.toml"):
        asyncio.run(Page().campaigns.run("x"))
