"""Interface between the editor server and a language: one value for each, in `steptwin.lsp.languages`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from steptwin.lsp.analysis import Analysis
from steptwin.lsp.documents import MOST_CHARACTERS
from steptwin.lsp.positions import LineIndex

T = TypeVar("T")


class MachineFiles(Protocol):
    """A controller of a world, as far as its files go. Addresses are normal ones."""

    @property
    def files(self) -> Iterable[str]:
        """Those that belong to it."""
        ...


M = TypeVar("M", bound=MachineFiles)


class OtherTexts(Protocol):
    """The other texts and files of a session. Addresses are normal ones."""

    def analysis(self, uri: str) -> Analysis | None:
        """Analysis of another text; None if there is none."""
        ...

    def lines(self, uri: str) -> LineIndex | None:
        """Another text, open or not."""
        ...

    def beside(self, uri: str, suffix: str) -> str | None:
        """The file of the same name with another ending."""
        ...

    def machines(self, kind: type[M]) -> Iterable[M]:
        """The controllers of all worlds that have been read as values of a type (`EditorLanguage.machines`)."""
        ...

    def files_of(self, world: str) -> Iterable[str]:
        """Those of all controllers of a world."""
        ...

    def derived(self, uri: str | None, make: Callable[..., T], *arguments: object) -> T | None:
        """``make(uri, text, *arguments)`` of a text, made anew only when the text has changed; None without a text."""
        ...

    def kept(self, uri: str, make: Callable[[], T]) -> T:
        """Value that a language keeps of a text beyond its changes, until it is closed."""
        ...

    def read(self, uri: str) -> bytes:
        """The content of a file, as it is in the editor where it is open. Raises `Misuse`."""
        ...

    def in_folder(self, uri: str) -> Sequence[str]:
        """The other files in the same folder that are in a language of these."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class EditorLanguage:
    """A language of texts."""

    name: str
    """For clients (``languageId``)."""
    suffix: str
    """Suffix of its files."""
    is_meant: Callable[[str], bool] = lambda text: True
    """Whether a text in a file with this suffix is one, because other programs use the suffix, too."""
    shares_name: bool = False
    """Whether a machine has one of its files under the same name as its others."""
    around: Callable[[OtherTexts, str], tuple[object, ...]] = lambda session, uri: ()
    """Sources of the analysis of a text beside the text."""
    analyse: Callable[[OtherTexts, str, LineIndex], Analysis]
    most_characters: int = MOST_CHARACTERS
    """Longer texts are not analysed."""
    machines: Callable[[str, str], list[MachineFiles]] | None = None
    """The controllers that a text describes, by its address and itself. Raises `Misuse` for one that cannot be read. None for
    languages that describe none."""
