"""Campaigns beside the description that a studio shows. They run in processes of their own."""

from __future__ import annotations

import asyncio
import json
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any

from steptwin.campaign.campaign import RESULTS, SUFFIX
from steptwin.campaign.report.comparison import REPORT
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.eventloop import later
from steptwin.files.ownfolder import path_in_folder
from steptwin.files.textfiles import read_text
from steptwin.inputfiles import MOST_DESCRIPTION_BYTES, read_recorded
from steptwin.live.studio.processes import ChildProcesses, Process, last_words
from steptwin.messages import NONE, Message
from steptwin.studio.campaignrequests import CAMPAIGN_IS_RUNNING, UNKNOWN_CAMPAIGN, CampaignResult, CampaignState

TABLE = "campaign"
MOST_FILES = 500
"""Limit of the descriptions that are read."""
PASSED, FAILED = 0, 1
"""Exit codes of a campaign that has ended."""
SERVED = (".html", ".json", ".xml", ".csv", ".py")


@dataclass(frozen=True, slots=True)
class _CampaignFile:
    """A file with a table ``[campaign]``, or one that cannot be read as such."""

    file: Path
    table: Mapping[str, Any]
    error: str | None = None

    @property
    def results(self) -> Path:
        return self.file.with_suffix(SUFFIX)


NO_FILE_OF_RESULTS = Message("live.no-file-of-results", "{name!r} is not a file of the results of a campaign here")


class FolderCampaigns:
    """See `steptwin.studio.campaignrequests.Campaigns`. A `Link` of the server. ``world``: the description."""

    def __init__(self, world: Path) -> None:
        self._world = world.absolute()
        self._processes = ChildProcesses()
        self._running: tuple[str, Process] | None = None
        self._errors: dict[str, str] = {}
        """Why the last run of a campaign did not end as one."""

    @property
    def _folder(self) -> Path:
        return self._world.parent

    # ------------------------------------------------------------------ requests

    async def list(self) -> Sequence[CampaignState]:
        running = self._present()
        found = await later(asyncio.to_thread(lambda: [_state(name, one) for name, one in self._known().items()]))
        return [
            replace(one, error=one.error or self._errors.get(one.campaign), is_running=one.campaign == running) for one in found
        ]

    async def run(self, campaign: str) -> None:
        known = await later(asyncio.to_thread(self._campaign, campaign))
        path_in_folder(self._folder, str(known.results))
        if (running := self._present()) is not None:
            raise Refusal(CAMPAIGN_IS_RUNNING(name=running))
        self._errors.pop(campaign, None)
        self._running = campaign, self._processes.start("steptwin", "campaign", "run", str(known.file))

    async def end(self, campaign: str) -> None:
        if self._present() == campaign and self._running is not None:
            process = self._running[1]
            self._running = None
            await later(asyncio.to_thread(self._processes.end, process))

    async def file(self, name: str) -> str:
        return await later(asyncio.to_thread(self._file, name))

    async def close(self) -> None:
        await asyncio.to_thread(self._processes.close)

    def _present(self) -> str | None:
        """The campaign that runs."""
        if self._running is None:
            return None
        name, process = self._running
        if process.poll() is None:
            return name
        self._running = None
        words = self._processes.end(process)
        if process.returncode not in (PASSED, FAILED):
            self._errors[name] = last_words(words)
        return None

    # ------------------------------------------------------------------ files, which are read in threads

    def _known(self) -> dict[str, _CampaignFile]:
        """By their paths from the folder of the description."""
        files = sorted([*self._folder.glob("*.toml"), *self._folder.glob("*/*.toml")])[:MOST_FILES]
        found = ((file.relative_to(self._folder).as_posix(), self._read(file)) for file in files if file != self._world)
        return {name: known for name, known in found if known is not None}

    def _read(self, file: Path) -> _CampaignFile | None:
        """None for what is not a campaign, or one of another world."""
        try:
            text = read_text(file, MOST_DESCRIPTION_BYTES).source.text
        except SteptwinError:
            return None
        try:
            table = tomllib.loads(text).get(TABLE)
        except (ValueError, RecursionError) as error:
            return _CampaignFile(file, {}, str(error)) if f"[{TABLE}]" in text else None
        if not isinstance(table, dict):
            return None
        world = table.get("world")
        is_of_this = isinstance(world, str) and (file.parent / world).resolve() == self._world.resolve()
        return _CampaignFile(file, table) if is_of_this else None

    def _campaign(self, name: str) -> _CampaignFile:
        known = self._known()
        if name not in known:
            raise Misuse(UNKNOWN_CAMPAIGN(name=name, names=list(known) or NONE()))
        return known[name]

    def _file(self, name: str) -> str:
        path = (self._folder / name).resolve()
        folders = [known.results.resolve() for known in self._known().values()]
        if not any(map(path.is_relative_to, folders)) or path.suffix not in SERVED or not path.is_file():
            raise Misuse(NO_FILE_OF_RESULTS(name=name))
        return str(path)


def _state(campaign: str, known: _CampaignFile) -> CampaignState:
    """As its files show it."""
    total = known.table.get("runs")
    database = known.results / RESULTS
    state = CampaignState(
        campaign=campaign,
        name=str(known.table.get("name", known.file.stem)),
        results=str(PurePosixPath(campaign).with_suffix(SUFFIX)),
        error=known.error,
        total=total if isinstance(total, int) else None,
    )
    if known.error is not None or not known.results.is_dir():
        return state
    state = replace(state, result=_result(known.results / REPORT))
    try:
        if database.is_file():
            from steptwin.campaign.store import counted

            done, failed = counted(database)
            return replace(state, done=done, failed=failed, changed=_changed(database))
    except (SteptwinError, ImportError) as error:
        return replace(state, error=str(error))
    return state


def _changed(database: Path) -> str:
    written = [database, database.with_name(f"{database.name}-wal")]
    at = max(file.stat().st_mtime for file in written if file.exists())
    return datetime.fromtimestamp(at, UTC).isoformat(timespec="seconds")


def _result(report: Path) -> CampaignResult | None:
    """Result of a campaign that has ended; None where it has not."""
    with suppress(SteptwinError, LookupError, TypeError, ValueError, AttributeError):
        return CampaignResult.of(json.loads(read_recorded(report)))
    return None
