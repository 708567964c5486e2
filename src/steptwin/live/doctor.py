"""Things that steptwin uses and this computer may lack: the page of the studio, libraries, ports, permissions, a browser."""

from __future__ import annotations

import os
import platform
import webbrowser
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from steptwin.errors import Misuse, Refusal
from steptwin.extras import extras, lacking
from steptwin.live.clients import is_taken
from steptwin.live.directory import private_directory, runtime_directory
from steptwin.live.ports import serial_ports
from steptwin.live.studio.demo import HOST, PORTS
from steptwin.live.studio.openpage import DEFAULT, has_desktop
from steptwin.simulation.toml.addresses import Address
from steptwin.studio.page import find_page
from steptwin.system import HAS_OWNERS, reason


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was examined, what was found, and what to do where it is not as it should be.

    An extra that is not installed is as it should be: the command that needs it names it.
    """

    what: str
    found: str
    todo: str = ""
    is_vital: bool = False
    """Without it `steptwin studio` does not run."""


def examine() -> Iterator[Finding]:
    """All findings, one after the other; only the runtime directory is made where it is missing."""
    yield Finding("Python", f"{platform.python_version()} on {platform.system()} {platform.machine()}")
    yield _runtime_directory()
    yield _page()
    yield from (_extra(extra) for extra in extras() if extra != "all")
    yield from (_port(Address(HOST, port)) for port in (DEFAULT.port, *PORTS))
    yield from _serial_ports()
    yield _browser()


def _runtime_directory() -> Finding:
    path = runtime_directory()
    try:
        private_directory(path)
        if os.access(path, os.R_OK | os.W_OK | os.X_OK):
            return Finding("runtime directory", str(path))
        found = "no permission to write"
    except (Misuse, OSError) as error:
        found = reason(error)
    todo = "set XDG_RUNTIME_DIR to a directory of yours: running twins are found in it"
    return Finding("runtime directory", f"{path}: {found}", todo, is_vital=True)


def _page() -> Finding:
    try:
        return Finding("page of the studio", str(find_page()))
    except Refusal as error:
        return Finding("page of the studio", "not built", str(error), is_vital=True)


def _extra(extra: str) -> Finding:
    names = lacking(extra)
    if not names:
        return Finding(f"extra {extra}", "installed")
    if extra == "studio":
        todo = "pip install 'steptwin[studio]', in a clone make extras"
        return Finding("extra studio", f"without {', '.join(names)}", todo, is_vital=True)
    return Finding(f"extra {extra}", "not installed")


def _port(address: Address) -> Finding:
    if not is_taken(address):
        return Finding(f"port {address.port}", "free")
    return Finding(f"port {address.port}", "taken", "'steptwin twins' lists those of yours; the demo machine takes another port")


def _serial_ports() -> Iterator[Finding]:
    for port in serial_ports():
        path = Path(port.address)
        if not HAS_OWNERS or os.access(path, os.R_OK | os.W_OK):
            yield Finding(port.address, port.what)
        else:
            todo = f"become a member of its group: sudo usermod -aG {path.group()} $USER, and log in again"
            yield Finding(port.address, f"{port.what}, no permission to open it", todo)


def _browser() -> Finding:
    try:
        webbrowser.get()
    except webbrowser.Error:
        return Finding("browser", "none found", "open the printed address in a browser of this computer, or by 'ssh -L'")
    return Finding(
        "browser", "found" if has_desktop() else "found; the page is not opened by itself, as this is no terminal of a desktop"
    )
