"""``python -m steptwin`` is the command ``steptwin``."""

from __future__ import annotations

from steptwin.cli import main

if __name__ == "__main__":
    main()
