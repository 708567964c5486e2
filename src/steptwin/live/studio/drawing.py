"""The arrangement of the machine panel of a studio, kept in the description of its world."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files.ownfolder import path_in_folder
from steptwin.files.textfiles import read_text, write_bytes
from steptwin.messages import Message
from steptwin.simulation.describe.arrangement import OTHERS, DrawnPosition, arranged
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.studio.drawingrequests import Drawing, SavedDrawing

NO_PLACE_OF = Message("live.no-place-of", "places: no axis or element is called {name!r}; there are {names}")


class WorldArrangement:
    """See `steptwin.studio.drawingrequests.Arrangement`. ``names``: of axes and elements; ``file``: the description, None for a
    world without such a file."""

    def __init__(self, spec: WorldSpec, names: Sequence[str], file: Path | None) -> None:
        self._spec = spec
        self._known = {*names, *OTHERS}
        self._file = file
        self._places: Sequence[DrawnPosition] = spec.drawing

    def drawing(self) -> Drawing:
        return Drawing(self._places, None if self._file is None else str(self._file))

    def save(self, places: Sequence[DrawnPosition]) -> SavedDrawing:
        if strange := [place.of for place in places if place.of not in self._known]:
            raise Misuse(NO_PLACE_OF(name=strange[0], names=sorted(self._known)))
        name = f"{self._spec.name if self._file is None else self._file.stem}.toml"
        if self._file is None:
            text = arranged(self._spec.text.source.text, places)
            self._places = places
            return SavedDrawing(None, name, text)
        now = read_text(self._file)  # it may have been changed since
        text = arranged(now.source.text, places)
        try:
            write_bytes(path_in_folder(self._file.parent, self._file.name), now.to_bytes(text))
        except Misuse:
            return SavedDrawing(None, name, text)
        finally:
            self._places = places
        return SavedDrawing(str(self._file), name, text)
