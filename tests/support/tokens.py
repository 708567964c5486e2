"""Files of tokens."""

from __future__ import annotations

from pathlib import Path


def tokens_file(folder: Path, text: str, mode: int = 0o600) -> Path:
    """A file with ``text`` in ``folder``, by default one that only its owner can read."""
    path = folder / "tokens"
    path.write_text(text)
    path.chmod(mode)
    return path
