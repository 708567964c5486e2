"""steptwin: the WObit MIC488 and the Microcon M1486 motion controllers as software.

From here come worlds (`World`) and the errors that callers handle; drivers come from `steptwin.drivers`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError

if TYPE_CHECKING:
    from steptwin.files.world import World

__version__ = "1.0.0"

__all__ = ["LineFailure", "Misuse", "Refusal", "SteptwinError", "World", "__version__"]


def __getattr__(name: str) -> Any:
    if name == "World":  # late, for the command line answers within 0.2 s
        import steptwin.services  # noqa: F401  its tables of descriptions are checked, too
        from steptwin.files.world import World

        return World
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
