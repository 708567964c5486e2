"""The texts of programs as sources of an editor: files, or texts that the editor asks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from steptwin.dap.target import Target
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse


class Text(NamedTuple):
    """A text of a controller, and its file, if that is there."""

    controller: str
    text: str
    path: Path
    source: SourceText


def texts_of(target: Target, folder: Path) -> Sequence[Text]:
    """The texts of all controllers; their files are in a folder."""
    return [
        Text(controller, text, (folder / source.name).resolve(), source)
        for controller in target.threads
        for text, source in target.texts(controller).items()
    ]


class Sources:
    """Those of a session. A text without a file has a number, from 1."""

    def __init__(self, texts: Sequence[Text]) -> None:
        self._texts = texts

    @property
    def known(self) -> str:
        return ", ".join(str(text.path) for text in self._texts) or "none"

    def check(self, program: Path, world: Path) -> None:
        """Raises `Misuse` for a program that is none of a world."""
        if not self.of(program.resolve()):
            raise Misuse(f"launch: {program} is not a program of {world}: there are {self.known}")

    def of(self, path: Path) -> Sequence[Text]:
        """The texts with a file: several controllers may have the same."""
        return [text for text in self._texts if text.path == path]

    def path(self, source: Mapping[str, Any]) -> Path:
        """Path of a source of the editor. Raises `Misuse`."""
        reference = source.get("sourceReference")
        return self.numbered(reference).path if reference else Path(source["path"]).resolve()

    def numbered(self, reference: object) -> Text:
        """Raises `Misuse`."""
        if not isinstance(reference, int) or not 1 <= reference <= len(self._texts):
            raise Misuse(f"sourceReference = {reference!r}: permitted are 1 to {len(self._texts)}")
        return self._texts[reference - 1]

    def to_json(self, controller: str, text: str) -> Mapping[str, object]:
        """A source as the protocol has it."""
        number, found = next((i, t) for i, t in enumerate(self._texts, start=1) if (t.controller, t.text) == (controller, text))
        if found.path.is_file():
            return {"name": found.path.name, "path": str(found.path)}
        return {"name": f"{controller}, {found.path.name}", "sourceReference": number}

    def all(self) -> Sequence[Mapping[str, object]]:
        found = {text.path: self.to_json(text.controller, text.text) for text in self._texts}
        return list(found.values())
