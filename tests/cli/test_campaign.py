"""``steptwin campaign run`` and ``show``."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from campaigns import CAMPAIGN, campaign_file
from postgres import postgres_server, programs
from shell import Shell

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.results import StoredCase
from steptwin.campaign.store import CampaignStore
from steptwin.coverage.counts import Coverage


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return campaign_file(tmp_path)


def test_a_campaign_with_failures(shell: Shell, file: Path, tmp_path: Path) -> None:
    out = shell("campaign", "run", str(file), "--jobs", "1", "--out", str(tmp_path / "out"))
    assert shell.code == 1
    campaign = Campaign.load(file)
    early = [n for n in range(40) if float(campaign.cases[n].values["t"]) <= 1.0]
    first, *lines = out.splitlines()
    assert first.startswith(f"doors: 40 runs, {len(early)} failed: {(40 - len(early)) / 40:.2%} pass (95 %: ")
    cases = [line for line in lines if line.startswith("case ")]
    values = campaign.cases[early[0]].values
    assert cases[0] == f"case {early[0]}: t = {values['t']} s: expectations of the scripts: table.IN1 == 0; table.IN1 is 1"
    assert len(cases) == min(len(early), 20)
    plain = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (plain["runs"], plain["failed"], plain["pass_rate"]) == (40, len(early), (40 - len(early)) / 40)
    assert plain["interval"][0] < plain["pass_rate"] < plain["interval"][1]
    assert lines[-2] == f"seed 7, digest {plain['digest']}"


def test_json_is_the_summary(shell: Shell, file: Path, tmp_path: Path) -> None:
    out = json.loads(shell("campaign", "run", str(file), "--jobs", "1", "--out", str(tmp_path / "out"), "--json"))
    assert out == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert json.loads(shell("campaign", "show", str(tmp_path / "out"), "--json")) == out
    assert shell.code == 1


def test_the_results_lie_beside_the_file_and_runs_are_added(shell: Shell, file: Path) -> None:
    shell("campaign", "run", str(file), "--jobs", "1", "--runs", "2")
    shell("campaign", "run", str(file), "--jobs", "1", "--runs", "5")
    assert json.loads((file.with_suffix(".results") / "summary.json").read_text())["runs"] == 5
    assert shell("campaign", "show", str(file.with_suffix(".results"))).startswith("doors: 5 runs")


def test_a_campaign_without_failures_has_exit_code_0(shell: Shell, tmp_path: Path) -> None:
    file = campaign_file(tmp_path, CAMPAIGN.replace("seed = 7", "seed = 7\nexpectations = false"))
    out = shell("campaign", "run", str(file), "--jobs", "1", "--runs", "10")
    assert shell.code == 0
    assert "10 runs, 0 failed: 100.00% pass" in out
    shell("campaign", "show", str(file.with_suffix(".results")))
    assert shell.code == 0


def test_a_database_that_fails_has_an_exit_code_of_its_own(shell: Shell, file: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "results.db").write_bytes(b"no database" * 100)
    shell("campaign", "run", str(file), "--jobs", "1", "--out", str(tmp_path / "out"), "--json")
    assert shell.code == 3
    told = json.loads(shell.errors)
    assert told["code"] == 3
    assert "out/results.db: file is not a database; the file is damaged, or was never a database: put a copy" in told["error"]


def test_a_server_that_goes_away_has_this_exit_code_too_and_the_campaign_goes_on_later(
    shell: Shell, tmp_path: Path, require_peer: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    where = programs()
    require_peer("postgresql: initdb" if where is None else str(where / "initdb"))
    assert where is not None
    add, added = CampaignStore.add, list[int]()
    with postgres_server(where) as server:

        def add_and_crash(store: CampaignStore, found: Sequence[StoredCase], coverage: Coverage | None = None) -> None:
            add(store, found, coverage)
            added.append(len(found))
            server.crash()

        file = campaign_file(tmp_path, CAMPAIGN.replace("seed = 7", f'seed = 7\ndatabase = "{server.url}"'))
        run = ("campaign", "run", str(file), "--jobs", "1", "--out", str(tmp_path / "out"))
        with monkeypatch.context() as patch:
            patch.setattr(CampaignStore, "add", add_and_crash)
            shell(*run)
        told = shell.errors
        assert (shell.code, len(added)) == (3, 1)
        assert f"127.0.0.1:{server.port}" in told
        assert "see that the server runs and can be reached, and run it again: what was written before stays" in told
        assert "Traceback" not in told
        shell(*run)
        assert (shell.code, "see that the server runs" in shell.errors) == (3, True)
        server.start()
        assert server.query("select count(*) from campaign_case") == str(added[0])
        assert shell(*run).startswith("doors: 40 runs")
        assert shell.code == 1


def test_until_failure_ends_with_the_first(shell: Shell, file: Path, tmp_path: Path) -> None:
    campaign = Campaign.load(file)
    first = next(n for n in range(40) if float(campaign.cases[n].values["t"]) <= 1.0)
    out = shell("campaign", "run", str(file), "--until-failure", "--jobs", "1", "--out", str(tmp_path / "out"))
    assert out.startswith(f"doors: {first + 1} runs, 1 failed")


def test_coverage_and_export(shell: Shell, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    (tmp_path / "loop.prg").write_text("LOOP:\nDELAY 0.1\nJUMP LOOP\n")
    file = campaign_file(
        tmp_path,
        '[campaign]\nworld = "world.toml"\nend = "1 s"\nruns = 3\n',
        '[[mic488]]\nname = "table"\nprogram = "loop.prg"\nstart = true\n',
    )
    table, lcov = tmp_path / "runs.parquet", tmp_path / "c.info"
    out = shell(
        "campaign", "run", str(file), "--jobs", "1", "--coverage", "-", "--coverage", str(lcov), "--export", str(table)
    )  # fmt: skip
    assert "loop.prg" in out
    assert "100.0 %" in out
    assert f"SF:{tmp_path / 'loop.prg'}" in lcov.read_text()
    assert parquet.read_table(table).to_pydict()["number"] == [0, 1, 2]
    more = shell("campaign", "run", str(file), "--jobs", "1", "--runs", "5")
    assert "coverage is that of" not in more
    again = shell("campaign", "run", str(file), "--jobs", "1", "--runs", "6", "--coverage", "-")
    assert "coverage is that of 4 of the runs: the others were before it was asked for" in again


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--runs", "0"), "runs 0: must be 1 or more"),
        (("--jobs", "0"), "jobs 0: permitted are 1 to 1024"),
        (("--seed", "-1"), "seed -1: permitted are whole numbers from 0"),
        (("--time", "soon"), "'soon' is not a time"),
        (("--coverage", "x.txt"), "the name must end with .info, .html, .json"),
        (("--export", "x.csv"), "--export x.csv: the name must end with .parquet"),
    ],
)
def test_wrong_options(shell: Shell, file: Path, arguments: tuple[str, ...], message: str) -> None:
    shell("campaign", "run", str(file), *arguments)
    assert shell.code == 2
    assert message in shell.errors


def test_another_seed_needs_another_folder(shell: Shell, file: Path) -> None:
    shell("campaign", "run", str(file), "--jobs", "1", "--runs", "2")
    shell("campaign", "run", str(file), "--jobs", "1", "--runs", "2", "--seed", "8")
    assert shell.code == 2
    assert "give another --out" in shell.errors


def test_folders_without_results(shell: Shell, file: Path, tmp_path: Path) -> None:
    shell("campaign", "show", str(tmp_path))
    assert f"{tmp_path} has no summary.json: it has no results" in shell.errors
    Campaign.load(file).open_store(tmp_path).close()
    shell("campaign", "show", str(tmp_path))
    assert "its campaign has not ended, run it again to go on" in shell.errors
    (tmp_path / "summary.json").write_text("{}")
    shell("campaign", "show", str(tmp_path))
    assert "summary.json is not a summary of a campaign" in shell.errors
    assert shell.code == 2


def test_an_out_that_is_no_folder(shell: Shell, file: Path) -> None:
    shell("campaign", "run", str(file), "--jobs", "1", "--out", str(file))
    assert shell.code == 2
    assert f"--out {file}: " in shell.errors


def test_what_is_wrong_with_the_file_is_shown_in_it(shell: Shell, tmp_path: Path) -> None:
    file = campaign_file(tmp_path, CAMPAIGN.replace("between", "betwen"))
    shell("campaign", "run", str(file))
    assert shell.code == 2
    assert "has no 'betwen' (did you mean 'between'?)" in shell.errors
