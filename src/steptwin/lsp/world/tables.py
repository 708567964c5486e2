"""Values of tables that may be wrong, while a text is edited."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def text_of(table: Mapping[str, Any], key: str) -> str | None:
    """None where there is no text under a key."""
    value = table.get(key)
    return value if isinstance(value, str) and value.strip() else None
