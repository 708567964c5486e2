"""Makes the archives of the studio inside a page. Pyodide's own Python runs this, for which they are compiled (`site.mjs`)."""

from __future__ import annotations

import ast
import encodings.aliases
import gzip
import importlib.util
import io
import marshal
import os.path
import sys
import zipfile
from collections.abc import Iterator, Mapping

LIBRARY = "/lib/python{}{}.zip".format(*sys.version_info)
UNUSED = frozenset(
    (
        "argparse", "bdb", "cmd", "code", "doctest", "html", "optparse", "pdb", "pydoc", "pyodide.console", "unittest", "_pyrepl",
        "asyncio.proactor_events", "asyncio.windows_events", "asyncio.windows_utils", "ctypes", "multiprocessing", "tarfile",
        "concurrent.futures.process", "ftplib", "http", "smtplib", "socketserver", "urllib.request", "webbrowser", "xmlrpc",
    )
)  # fmt: skip
"""Parts of the standard library for a terminal, for processes or sockets: what only other parts of it import no page calls."""


def pack(sources: Mapping[str, str | bytes]) -> bytes:
    """An archive of compiled modules and other files, which is always the same. Modules have no docstrings, of places lines only.

    It is packed as a whole: a fifth smaller than one in which each module is packed, and Python need not unpack any of them."""
    return gzip.compress(archive_of(sources, zipfile.ZIP_STORED), 9, mtime=0)


def archive_of(sources: Mapping[str, str | bytes], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", compresslevel=9) as archive:
        for name, source in sorted(sources.items()):
            if not name.endswith(".py"):
                archive.writestr(zipfile.ZipInfo(name), source, compression)
                continue
            code = marshal.dumps(compile(source, name, "exec", dont_inherit=True, optimize=2))
            unchecked = importlib.util.MAGIC_NUMBER + (1).to_bytes(4, "little") + bytes(8)
            archive.writestr(zipfile.ZipInfo(name + "c"), unchecked + code, compression)
    return made.getvalue()


def library(own: Mapping[str, str]) -> Mapping[str, bytes]:
    """The modules of the standard library that ``own`` ones or Pyodide can reach."""
    with zipfile.ZipFile(LIBRARY) as archive:
        there = {name: archive.read(name) for name in archive.namelist() if name.endswith(".py")}
    found: dict[str, bytes] = {}
    waiting = [name for name in sys.modules if not name.startswith("__")]
    for name, source in own.items():
        if not name.endswith(".py"):
            continue
        waiting += _named(source, name)
    unused = UNUSED.difference(*map(_with_packages, waiting))
    while waiting:
        for module in _with_packages(waiting.pop()):
            if module in unused:
                break
            path = module.replace(".", "/")
            for file in (f"{path}.py", f"{path}/__init__.py"):
                if file in there and file not in found:
                    found[file] = there[file]
                    waiting += _named(there[file], file)
    return found


def _with_packages(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[: count + 1]) for count in range(len(parts))]


def _named(source: str | bytes, file: str) -> Iterator[str]:
    """What a module can import, and what it could: an attribute may be a module, and a text may name a codec."""
    package = os.path.dirname(file).split("/")
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Import():
                yield from (one.name for one in node.names)
            case ast.ImportFrom():
                above = package[: len(package) - node.level + 1] if node.level else []
                base = ".".join([*above, *([node.module] if node.module else [])])
                yield from (f"{base}.{one.name}" for one in node.names)
            case ast.Constant(value=str(text)) if text.isascii() and len(text) < 20 and package != ["encodings"]:
                codec = encodings.normalize_encoding(text).lower()
                yield f"encodings.{encodings.aliases.aliases.get(codec, codec)}"
