"""The interface of the editor server to a language: one `EditorLanguage` for each, in `steptwin.lsp.languages`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, TypeVar

from steptwin.lsp.analysis import Analysis
from steptwin.lsp.documents import MOST_CHARACTERS
from steptwin.lsp.positions import LineIndex
from steptwin.optionalmethods import OptionalMethods

T = TypeVar("T")


class ControllerFiles(Protocol):
    """A controller of a world, as far as its files go. Addresses are normal ones."""

    @property
    def files(self) -> Iterable[str]:
        """Files that belong to it."""
        ...


M = TypeVar("M", bound=ControllerFiles)


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

    def controllers(self, kind: type[M]) -> Iterable[M]:
        """The controllers of all worlds that have been read as values of a type (`EditorLanguage.controllers`)."""
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


class EditorLanguage(OptionalMethods, ABC):
    """A language of texts: one object of one class."""

    @property
    @abstractmethod
    def name(self) -> str:
        """For clients (``languageId``)."""

    @property
    @abstractmethod
    def suffix(self) -> str:
        """Suffix of its files."""

    shares_name: bool = False
    """Whether a controller has one of its files under the same name as its others."""
    most_characters: int = MOST_CHARACTERS
    """Longer texts are not analysed."""

    def is_meant(self, text: str, /) -> bool:
        """Whether a text in a file with this suffix is one, because other programs use the suffix, too."""
        return True

    def around(self, session: OtherTexts, uri: str, /) -> tuple[object, ...]:
        """Sources of the analysis of a text beside the text."""
        return ()

    @abstractmethod
    def analyse(self, session: OtherTexts, uri: str, lines: LineIndex, /) -> Analysis: ...

    def controllers(self, uri: str, text: str, /) -> list[ControllerFiles]:
        """The controllers that a text describes, by its address and itself, of a language that describes any. Raises `Misuse` for
        one that cannot be read."""
        return []
