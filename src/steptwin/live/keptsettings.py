"""Settings of devices, saved before the first write: files in the state directory of the user."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files.writing import new_text
from steptwin.live.directory import private_directory
from steptwin.messages import Message
from steptwin.system import reason


def state_directory() -> Path:
    """``XDG_STATE_HOME`` or ``~/.local/state``, on Windows ``LOCALAPPDATA``; in it ``steptwin``. It need not exist."""
    base = os.environ.get("XDG_STATE_HOME") or os.environ.get("LOCALAPPDATA")
    return (Path(base) if base else Path.home() / ".local" / "state") / "steptwin"


SETTINGS_ARE_NOT_KEPT = Message(
    "live.settings-are-not-kept", "nothing was written: the settings of {controller} cannot be kept in {path}: {reason}"
)


def keep_settings(controller: str, text: str) -> str:
    """Write a new file with the settings of a controller; its path. Raises `Misuse` if that is not possible."""
    path = state_directory() / "settings"
    try:
        private_directory(path)
        path /= f"{controller}-{datetime.now(UTC):%Y%m%d-%H%M%S-%f}.json"
        with new_text(path) as file:
            file.write(text)
    except OSError as error:
        raise Misuse(SETTINGS_ARE_NOT_KEPT(controller=controller, path=path, reason=reason(error))) from error
    return str(path)
