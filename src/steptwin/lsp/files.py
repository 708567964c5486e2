"""Files that belong to open texts: by address (URI), as the client names them. The addresses of what is found are normal ones."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol
from urllib.parse import quote_from_bytes, unquote_to_bytes, urlsplit, urlunsplit

from steptwin.errors import Misuse
from steptwin.inputfiles import MOST_DESCRIPTION_BYTES, read_bytes

MOST_BESIDE = 200
"""Limit of the files of a folder that are read."""
_UNQUOTED = "/:@!$&'()*+,;=~"


class Files(Protocol):
    """Where files are read that are not open. A studio in a browser has others than a disk."""

    def stamp(self, uri: str) -> object | None:
        """A value that differs when the file has changed; None if there is no file."""
        ...

    def read(self, uri: str) -> bytes:
        """The content. Raises `Misuse`."""
        ...

    def beside(self, uri: str, suffix: str) -> list[str]:
        """Addresses of the files in the same folder whose names end so."""
        ...


class NoFiles:
    """Only open texts exist."""

    def stamp(self, uri: str) -> object | None:
        return None

    def read(self, uri: str) -> bytes:
        raise Misuse(f"{uri} is not open")

    def beside(self, uri: str, suffix: str) -> list[str]:
        return []


class GivenTexts:
    """Constant texts by normal address, all in one folder."""

    def __init__(self, texts: Mapping[str, bytes]) -> None:
        self._texts = texts

    def stamp(self, uri: str) -> object | None:
        return 0 if uri in self._texts else None

    def read(self, uri: str) -> bytes:
        if uri not in self._texts:
            raise Misuse(f"{uri} is not open")
        return self._texts[uri]

    def beside(self, uri: str, suffix: str) -> list[str]:
        return sorted(name for name in self._texts if name.lower().endswith(suffix) and name != uri)


class DiskFiles:
    """The files of this machine, for addresses of the scheme ``file``."""

    def stamp(self, uri: str) -> object | None:
        path = _path(uri)
        try:
            found = None if path is None else path.stat()
        except (OSError, ValueError):
            return None
        return None if found is None else (found.st_mtime_ns, found.st_size, found.st_ino)

    def read(self, uri: str) -> bytes:
        path = _path(uri)
        if path is None:
            raise Misuse(f"{uri} is not a file")
        return read_bytes(path, MOST_DESCRIPTION_BYTES)

    def beside(self, uri: str, suffix: str) -> list[str]:
        path = _path(uri)
        if path is None:
            return []
        found: list[str] = []
        try:
            with os.scandir(path.parent) as entries:
                for entry in entries:
                    if entry.name.lower().endswith(suffix):
                        found.append(relative(uri, entry.name))
                        if len(found) == MOST_BESIDE:
                            break
        except (OSError, ValueError):
            return []
        return sorted(found)


def normal(uri: str) -> str:
    """One spelling of an address, because clients quote different characters."""
    try:
        parts = urlsplit(uri)
    except ValueError:
        return uri
    path = quote_from_bytes(unquote_to_bytes(parts.path), safe=_UNQUOTED)
    return urlunsplit((parts.scheme, parts.netloc, path, parts.query, parts.fragment))


def relative(uri: str, name: str) -> str:
    """The normal address of a file named in another, seen from the folder of the latter."""
    folder, _, _ = normal(uri).rpartition("/")
    quoted = quote_from_bytes(os.fsencode(name.replace("\\", "/")), safe=_UNQUOTED)
    parts: list[str] = folder.split("/") if not quoted.startswith("/") else [uri.partition("://")[0] + ":", "", ""]
    for part in quoted.lstrip("/").split("/"):
        if part == ".." and len(parts) > 3:
            parts.pop()
        elif part not in (".", ".."):
            parts.append(part)
    return "/".join(parts)


def name_of(uri: str) -> str:
    """The last part of an address, as it is shown."""
    return os.fsdecode(unquote_to_bytes(normal(uri).rpartition("/")[2]))


def with_suffix(uri: str, suffix: str) -> str:
    """The normal address with another ending of its name."""
    folder, slash, name = normal(uri).rpartition("/")
    stem = name.rpartition(".")[0] or name
    return f"{folder}{slash}{stem}{suffix}"


def suffix_of(uri: str) -> str:
    """The ending of a name in lower case, ``.prg``."""
    _, dot, end = normal(uri).rpartition("/")[2].rpartition(".")
    return f".{end.lower()}" if dot else ""


def _path(uri: str) -> Path | None:
    try:
        parts = urlsplit(uri)
    except ValueError:
        return None
    return Path(os.fsdecode(unquote_to_bytes(parts.path))) if parts.scheme == "file" else None
