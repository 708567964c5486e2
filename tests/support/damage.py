"""Plain data with something in it replaced: what a damaged or made-up file of JSON holds."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3) | st.just(10**400) | st.just(2**63),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["hex", "segments", "name"]), inner, max_size=2),
    max_leaves=4,
)
"""What may stand where something else is expected."""

WAYS = st.lists(st.integers(0, 20), min_size=1, max_size=6)


def damaged(data: Any, way: list[int], value: Any) -> Any:
    """The data with what lies on a way into it replaced."""
    if not way or not isinstance(data, dict | list) or not data:
        return value
    if isinstance(data, list):
        at = way[0] % len(data)
        return [damaged(item, way[1:], value) if i == at else item for i, item in enumerate(data)]
    at = list(data)[way[0] % len(data)]
    return {key: damaged(item, way[1:], value) if key == at else item for key, item in data.items()}
