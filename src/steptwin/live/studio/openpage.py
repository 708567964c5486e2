"""The page of a studio in the browser of the desktop."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser
from html import escape
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.live.directory import private_directory, runtime_directory
from steptwin.live.studio.owntokens import write_private
from steptwin.simulation.toml.addresses import Address
from steptwin.system import reason

DEFAULT = Address("127.0.0.1", 8488)
"""Address of the page."""

LEADING = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>steptwin studio</title>
<meta http-equiv="refresh" content="0; url={url}"></head>
<body><p><a href="{url}">steptwin studio</a></p></body></html>
"""


def has_desktop() -> bool:
    """Whether it runs in a terminal of a desktop with a browser."""
    if not sys.stdout.isatty() or os.environ.get("SSH_CONNECTION"):
        return False
    return sys.platform in ("win32", "darwin") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


class OpenedPage:
    """Opens ``url``, and leaves nothing behind once it is closed.

    An address with a secret comes to the browser in a file that only this user can read: every user of the computer can read the
    command line of a browser.
    """

    def __init__(self, url: str, *, is_secret: bool, port: int) -> None:
        """Raises `Misuse` where the file cannot be written."""
        self.file: Path | None = None
        """File from which the browser reads the address; None if that is no secret."""
        if is_secret:
            self.file = runtime_directory() / f"studio-{port}.html"
            try:
                private_directory(self.file.parent)
                self.file.unlink(missing_ok=True)
                write_private(self.file, LEADING.format(url=escape(url)))
            except OSError as error:
                raise Misuse(f"the page is not opened: cannot write {self.file}: {reason(error)}") from error
            url = self.file.as_uri()
        threading.Thread(target=webbrowser.open, args=(url,), name="browser", daemon=True).start()

    def close(self) -> None:
        if self.file is not None:
            self.file.unlink(missing_ok=True)
