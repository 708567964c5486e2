"""Recordings of the twin of a page, which are downloads of the browser."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from steptwin.eventloop import later
from steptwin.files.recording import Recording, text_of
from steptwin.files.savedrecordings import path_of, usual_name
from steptwin.inpage.connections import Page
from steptwin.live.realtimedriver import REST_S
from steptwin.live.studio.recordedextent import recordings_of
from steptwin.live.world import LiveWorld
from steptwin.studio.recordingrequests import RecordingFile, RecordingsOfWorld

INPUTS_AT_ONCE = 200
"""Messages of the page, a stop too, come between so many inputs of a text."""


class PageRecordings:
    """See `steptwin.studio.recordingrequests.Recordings`. ``enter`` brings the world to the present, ``leave`` lets it go on."""

    def __init__(self, live: LiveWorld, page: Page, enter: Callable[[], object], leave: Callable[[], object]) -> None:
        self._live = live
        self._page = page
        self._enter = enter
        self._leave = leave

    async def list(self) -> RecordingsOfWorld:
        return recordings_of(self._live)

    async def save(self, name: str | None) -> RecordingFile:
        file = path_of(Path(), name or usual_name(self._live.world.spec.name, datetime.now(UTC)))
        self._enter()
        try:
            recording = self._live.recording()
        finally:
            self._leave()
        text = await later(_text(recording))
        self._page.saveText(file.name, text)
        return RecordingFile(file.stem, len(text), datetime.now(UTC).isoformat(timespec="milliseconds"), recording.until)


async def _text(recording: Recording) -> str:
    parts: list[str] = []
    for part in text_of(recording):
        parts.append(part)
        if not len(parts) % INPUTS_AT_ONCE:
            await asyncio.sleep(REST_S)
    return "".join(parts)
