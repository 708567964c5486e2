"""The site as `make site` builds it, at a static web server below a path, with the policy in each answer."""

from __future__ import annotations

import functools
import json
import os
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from steptwin.studio.guard import POLICY

ROOT = Path(__file__).parents[2]
TRY = ROOT / "build/site/try"
SITE_POLICY = POLICY.replace("script-src 'self'", "script-src 'self' 'wasm-unsafe-eval'")


class Handler(SimpleHTTPRequestHandler):
    is_newer = False
    """Whether the site has another version than it was built with."""
    lacks = "nothing"
    """End of the addresses of files that are not there."""

    def translate_path(self, path: str) -> str:
        return super().translate_path(f"{path}.lost" if path.endswith(self.lacks) else path)

    def do_GET(self) -> None:
        if not (self.is_newer and self.path.endswith("/service.js")):
            super().do_GET()
            return
        content = Path(self.translate_path(self.path)).read_bytes() + b"// newer\n"
        self.send_response(200)
        self.send_header("content-type", "text/javascript")
        self.send_header("content-length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def end_headers(self) -> None:
        self.send_header("content-security-policy", SITE_POLICY)
        self.send_header("x-content-type-options", "nosniff")
        super().end_headers()

    def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002  that of the library
        """Nobody reads it."""


@pytest.fixture(scope="session")
def built() -> Path:
    """The folder with the page; skipped where it has not been built, an error where a source of it has changed since."""
    made = TRY / "service.js"
    if not made.exists():
        if os.environ.get("STEPTWIN_REQUIRE_PEERS") == "1":
            pytest.fail("build/site has not been built: run 'make site'", pytrace=False)
        pytest.skip("build/site has not been built: run 'make site'")
    archives = json.loads((ROOT / "build/modules.json").read_text("utf-8"))["archives"]
    modules = [*archives["steptwin"].values(), *archives["jobs"].values()]
    for source in [*map(Path, modules), *(ROOT / "studio-web/src/site").iterdir()]:
        if not source.exists() or source.stat().st_mtime > made.stat().st_mtime:
            pytest.fail(f"{source.relative_to(ROOT)} is not what build/site has in it: run 'make site'", pytrace=False)
    return TRY


@pytest.fixture(scope="module")
def address(built: Path) -> Iterator[str]:
    serving = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=built.parents[1]))
    thread = threading.Thread(target=serving.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{serving.server_port}/{built.parent.name}/{built.name}/"
    serving.shutdown()
    thread.join()
    serving.server_close()
