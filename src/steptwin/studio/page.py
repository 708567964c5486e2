"""Where the page of the studio is: a folder of files in the package, built by ``make page`` (``studio-web/README.md``)."""

from __future__ import annotations

from pathlib import Path

from steptwin.errors import Refusal
from steptwin.messages import Message

PAGE = Path(__file__).with_name("page")


PAGE_IS_NOT_BUILT = Message(
    "studio.page-is-not-built",
    "the page of the studio has not been built: 'make page' in the clone builds it; a wheel contains it",
)


def find_page() -> Path:
    """The folder with ``index.html``. Raises `Refusal` where it has not been built, as in a clone at first."""
    if not (PAGE / "index.html").is_file():
        raise Refusal(PAGE_IS_NOT_BUILT())
    return PAGE
