"""Recordings of a world of a page, which are downloads of the browser; and those that its user chooses, to be viewed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from typing import TypeVar

from steptwin.errors import Refusal
from steptwin.eventloop import later
from steptwin.files.recording import Recording, text_of
from steptwin.files.savedrecordings import path_of, usual_name
from steptwin.inpage.connections import Page
from steptwin.inpage.pagestudio import PageStudio
from steptwin.live.realtimedriver import REST_S
from steptwin.live.studio.recorded import Replayed, replayed
from steptwin.live.studio.recordedextent import recordings_of
from steptwin.live.timetravel import PART_S
from steptwin.messages import Message
from steptwin.studio.hub import NO_FOLDER_FOR_RECORDINGS
from steptwin.studio.recordingrequests import RecordingFile, RecordingsOfWorld

T = TypeVar("T")
INPUTS_AT_ONCE = 200
"""Messages of the page, a stop too, come between so many inputs of a text."""
MOST_BYTES = 8 << 20
"""Limit of a recording that is viewed: while its text is read no message comes."""
VIEW_S = 300.0
"""Longest duration of its replay."""
VIEW_TAKES_TOO_LONG = Message(
    "inpage.view-takes-too-long", "the replay of {path} takes more than {most_s:g} s: use steptwin studio {path} --view"
)


class PageRecordings:
    """See `steptwin.studio.recordingrequests.Recordings` and `RecordingFiles`. ``check`` raises `Refusal` where none can
    be shown, ``show`` shows one that has been replayed."""

    def __init__(self, studio: PageStudio, page: Page, check: Callable[[], None], show: Callable[[Replayed], None]) -> None:
        self._studio = studio
        self._page = page
        self._check = check
        self._show = show

    async def list(self) -> RecordingsOfWorld:
        return replace(recordings_of(self._studio.live), most_bytes=MOST_BYTES)

    async def save(self, name: str | None) -> RecordingFile:
        studio = self._studio
        file = path_of(Path(), name or usual_name(studio.world.spec.name, datetime.now(UTC)))
        studio.realtime.enter()
        try:
            recording = studio.live.recording()
        finally:
            studio.leave()
        text = await later(_text(recording))
        self._page.saveText(file.name, text)
        return RecordingFile(file.stem, len(text), datetime.now(UTC).isoformat(timespec="milliseconds"), recording.until)

    async def view(self, name: str) -> None:
        path = path_of(Path(), name)
        try:
            self._check()
            found = await later(_in_parts(replayed(path, MOST_BYTES), VIEW_TAKES_TOO_LONG(path=path, most_s=VIEW_S)))
        finally:
            path.unlink(missing_ok=True)
        self._show(found)

    def place(self, file: str) -> str:
        raise Refusal(NO_FOLDER_FOR_RECORDINGS())

    async def file(self, name: str) -> str:
        raise Refusal(NO_FOLDER_FOR_RECORDINGS())


async def _text(recording: Recording) -> str:
    parts: list[str] = []
    for part in text_of(recording):
        parts.append(part)
        if not len(parts) % INPUTS_AT_ONCE:
            await asyncio.sleep(REST_S)
    return "".join(parts)


async def _in_parts(work: Generator[None, None, T], too_long: str) -> T:
    """Its result. Messages of the page come between its parts. Raises `Refusal` after `VIEW_S`."""
    end = perf_counter() + VIEW_S
    while (now := perf_counter()) < end:
        while perf_counter() < now + PART_S:
            try:
                next(work)
            except StopIteration as done:
                return done.value
        await asyncio.sleep(REST_S)
    raise Refusal(too_long)
