"""Places that are changed in a studio and kept in the description of its world: of elements in space, of strips in the panel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files.ownfolder import path_in_folder
from steptwin.files.textfiles import TextFile, read_text, write_bytes
from steptwin.files.world import read_beside
from steptwin.messages import Message
from steptwin.simulation.describe.arrangement import OTHERS, DrawnPosition, arranged
from steptwin.simulation.describe.includes import no_files
from steptwin.simulation.describe.placement import placing
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.simulation.world.check import diagnose
from steptwin.studio.drawingrequests import Drawing, SavedDrawing, WrittenPlace

NO_PLACE_OF = Message("live.no-place-of", "places: no axis or element is called {name!r}; there are {names}")


class WorldArrangement:
    """See `steptwin.studio.drawingrequests.Arrangement`. ``names``: of axes and elements; ``file``: the description, None for a
    world without such a file."""

    def __init__(self, spec: WorldSpec, names: Sequence[str], file: Path | None) -> None:
        self._spec = spec
        self._known = {*names, *OTHERS}
        self._file = file
        self._places: Sequence[DrawnPosition] = spec.drawing
        self._unwritten = spec.text.source.text if file is None else None
        """The description with all changes, where they are in no file."""

    def drawing(self) -> Drawing:
        return Drawing(self._places, None if self._file is None else str(self._file))

    def save(self, places: Sequence[DrawnPosition]) -> SavedDrawing:
        if strange := [place.of for place in places if place.of not in self._known]:
            raise Misuse(NO_PLACE_OF(name=strange[0], names=sorted(self._known)))
        saved = self._save(lambda text: arranged(text, places))
        self._places = places
        return saved

    def place(self, name: str, at: Sequence[float] | None, *, write: bool) -> WrittenPlace:
        text = self._text()[0]
        found = placing(self._spec, text, name, at)
        saved = self._save(lambda _: found.text) if write else None
        problems = () if write or found.text == text else self._problems(found.text) - self._problems(text)
        return WrittenPlace(found.at, found.line, found.old, found.new, tuple(sorted(problems)), saved)

    def _problems(self, text: str) -> set[str]:
        read = no_files if self._file is None else partial(read_beside, self._file.parent)
        return {one.message for one in diagnose(self._spec.name, text, read).findings}

    def _text(self) -> tuple[str, TextFile | None]:
        """The description as it is now, which may have been changed since, and its file."""
        if self._file is None or self._unwritten is not None:
            return self._unwritten or "", None
        now = read_text(self._file)
        return now.source.text, now

    def _save(self, change: Callable[[str], str]) -> SavedDrawing:
        before, now = self._text()
        text = change(before)
        file = None
        if now is not None and self._file is not None:
            with suppress(Misuse):
                write_bytes(path_in_folder(self._file.parent, self._file.name), now.to_bytes(text))
                file = str(self._file)
        self._unwritten = text if file is None else None
        return SavedDrawing(file, f"{self._spec.name if self._file is None else self._file.stem}.toml", text)
