"""Sessions of the world that a studio shows: saved beside it, exported, and opened as studios of their own.

Exports and views are processes of their own, so that the world goes on undisturbed.
"""

from __future__ import annotations

import asyncio
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from steptwin.errors import Misuse, Refusal
from steptwin.eventloop import later
from steptwin.files import recording as recordings
from steptwin.files.export import FORMATS
from steptwin.files.loader import RECORDING_SUFFIX, is_recording
from steptwin.files.ownfolder import path_in_folder
from steptwin.files.savedrecordings import SavedRecording, path_of, read_saved, saved_recordings, usual_name
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.studio.processes import ChildProcesses, Process, last_words
from steptwin.live.studio.recordedextent import recordings_of
from steptwin.live.world import LiveWorld
from steptwin.messages import Message, text_of
from steptwin.studio.recordingrequests import RecordingFile, RecordingsOfWorld

EXPORT_S = 300.0
"""Longest duration of an export."""
MOST_VIEWS = 4
FILE_IS_THERE = Message("live.file-is-there", "{path} is there already: give another name")
VIEW_FROM_ELSEWHERE = Message(
    "live.view-from-elsewhere",
    "a view is reached from the computer of the studio only: start it with steptwin studio {path} --view",
)
UNKNOWN_FORMAT = Message("live.unknown-format", "{name}: formats are {names}")
UNKNOWN_RECORDING = Message("live.unknown-recording", "no recording is called {name!r} in {folder}")


class WorldRecordings:
    """See `steptwin.studio.recordingrequests.Recordings` and `RecordingFiles`. A `Link` of the server.

    ``folder``: where recordings are saved; ``stem``: how their names begin; ``access``: options of views about tokens. Views are
    served at a loopback address; None: they cannot be reached, so there are none.
    """

    def __init__(
        self, live: LiveWorld, realtime: RealTimeDriver, folder: Path, stem: str, file: Path | None, access: Sequence[str] | None
    ) -> None:
        self._live = live
        self._realtime = realtime
        self._folder = folder
        self._stem = stem
        self._file = file
        self._access = access
        self._processes = _Processes()

    # ------------------------------------------------------------------ requests

    async def list(self) -> RecordingsOfWorld:
        saved = await later(asyncio.to_thread(saved_recordings, self._folder))
        files = tuple([RecordingFile(*one) for one in saved])
        formats = tuple([name for name, form in FORMATS.items() if form.is_available])
        return recordings_of(self._live, file=self._file, folder=self._folder, saved=files, formats=formats)

    async def save(self, name: str | None) -> RecordingFile:
        path = path_in_folder(self._folder, path_of(self._folder, name or usual_name(self._stem, datetime.now(UTC))).name)
        self._realtime.enter()
        return RecordingFile(*await later(asyncio.to_thread(_save, self._live.recording(), path)))

    def place(self, file: str) -> str:
        path = path_in_folder(self._folder, file)
        if path.exists():
            if not is_recording(path):
                raise Refusal(FILE_IS_THERE(path=path))
            read_saved(path)  # whatever else is there is not overwritten
        return str(path)

    async def view(self, name: str) -> str:
        path = self._saved(name)
        if self._access is None:
            raise Refusal(VIEW_FROM_ELSEWHERE(path=path))
        return await later(asyncio.to_thread(self._processes.view, path, self._access))

    async def file(self, name: str) -> str:
        stem, _, form = name.rpartition(".")
        path = self._saved(stem)
        if f".{form}" == RECORDING_SUFFIX:
            return str(path)
        if form not in FORMATS:
            raise Misuse(UNKNOWN_FORMAT(name=name, names=[RECORDING_SUFFIX[1:], *FORMATS]))
        return str(await later(asyncio.to_thread(self._processes.export, path, form)))

    def _saved(self, name: str) -> Path:
        """Raises `Misuse` where there is no such recording."""
        path = path_of(self._folder, name)
        if not path.is_file():
            raise Misuse(UNKNOWN_RECORDING(name=name, folder=self._folder))
        read_saved(path)  # whatever else is there is nobody's business
        return path

    async def close(self) -> None:
        await asyncio.to_thread(self._processes.close)


EXPORT_TAKES_TOO_LONG = Message(
    "live.export-takes-too-long", "{name} as {form} takes more than {most_s:g} s: use steptwin replay and export"
)
VIEW_OF = Message("live.view-of", "the view of {name}")
EXPORT_FAILED = Message("live.export-failed", "{name} as {form}: {problem}")


class _Processes(ChildProcesses):
    """Exports and views. All methods block."""

    def __init__(self) -> None:
        super().__init__()
        self._views: dict[Path, tuple[Process, str]] = {}

    def export(self, path: Path, form: str) -> Path:
        """One at a time; what has been made is kept. Raises `Refusal`."""
        target = self.folder / f"{path.stem}.{form}"
        with self.turn:
            if target.exists() and target.stat().st_mtime > path.stat().st_mtime:
                return target
            target.unlink(missing_ok=True)
            process = self.start("steptwin", "replay", str(path), "--trace", str(target))
            try:
                _, errors = process.communicate(timeout=EXPORT_S)
            except subprocess.TimeoutExpired:
                raise Refusal(EXPORT_TAKES_TOO_LONG(name=path.name, form=form, most_s=EXPORT_S)) from None
            finally:
                self.end(process)
        if not target.exists():
            raise Refusal(EXPORT_FAILED(name=path.name, form=form, problem=text_of(last_words(errors))))
        return target

    def view(self, path: Path, access: Sequence[str]) -> str:
        """The address of a view, which may be running already; the oldest of too many ends. Raises `LineFailure`."""
        with self.turn:
            process, url = self._views.get(path, (None, ""))
            if process is not None and process.poll() is None:
                return url
            while len(self._views) >= MOST_VIEWS:
                self.end(self._views.pop(next(iter(self._views)))[0])
            ready = self.folder / f"{path.stem}.ready.json"
            ready.unlink(missing_ok=True)
            options = ("--view", "--no-browser", "--http", "127.0.0.1:0", "--ready-file", str(ready), *access)
            process = self.start("steptwin", "studio", str(path), *options)
            url = self.url(process, ready, VIEW_OF(name=path.name))
            self._views[path] = process, url
            return url


def _save(recording: recordings.Recording, path: Path) -> SavedRecording:
    """Raises `Refusal` where there is such a file, `Misuse` where it cannot be written."""
    if path.exists():
        raise Refusal(FILE_IS_THERE(path=path))
    recordings.save(recording, path)
    return read_saved(path)
