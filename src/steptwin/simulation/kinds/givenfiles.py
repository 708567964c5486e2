"""The files of a world, for what controllers say of their texts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from steptwin.diagnostics import Diagnostic, SourceText
from steptwin.simulation.kinds.links import LineSpec


class GivenFiles:
    """The files of a world that was built, whose warnings were reported then, and what was put into controllers since."""

    def __init__(
        self, lines: Sequence[LineSpec], files: Mapping[str, bytes], downloaded: Mapping[tuple[str, str], SourceText]
    ) -> None:
        """``downloaded``: what has been put into controllers, by controller and place."""
        self.lines = lines
        self._files = files
        self._downloaded = downloaded

    def data(self, name: str) -> bytes:
        """As `steptwin.simulation.kinds.kind.BuildContext.data`."""
        return self._files[name]

    def accept(self, source: SourceText, findings: Iterable[Diagnostic]) -> None:
        """As `steptwin.simulation.kinds.kind.BuildContext.accept`."""

    def downloaded(self, controller: str, place: str) -> SourceText | None:
        """As `steptwin.simulation.kinds.kind.TextContext.downloaded`."""
        return self._downloaded.get((controller, place))
