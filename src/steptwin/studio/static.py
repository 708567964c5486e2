"""The files of the page. They are found once, so no request leads to another file."""

from __future__ import annotations

import gzip
import mimetypes
from dataclasses import dataclass
from html import escape
from pathlib import Path

from fastapi import FastAPI, Request, Response

from steptwin.errors import Refusal
from steptwin.studio.page import find_page

INDEX = "index.html"
ASSETS = "assets/"
"""Files whose names have a digest of their content in them."""
FOR_EVER, EACH_TIME = "public, max-age=31536000, immutable", "no-cache"
WORTH_PACKING = 1024
"""Bytes."""
PACKED = ("text/", "application/json", "application/javascript", "image/svg+xml", "application/manifest+json")
NO_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>steptwin studio</title></head>
<body><h1>steptwin studio</h1><p>{why}.</p>
<p>The service runs: programs reach it over the WebSocket <code>/ws</code> and over REST, which
<a href="/openapi.json">/openapi.json</a> describes.</p></body></html>
"""


@dataclass(frozen=True, slots=True)
class _File:
    data: bytes
    packed: bytes | None
    type: str
    cache: str


def add_page(app: FastAPI) -> None:
    """The page at ``/``; where it has not been built, how to build it."""
    try:
        files = _files(find_page())
    except Refusal as error:
        text = NO_PAGE.format(why=escape(str(error)))
        files = {INDEX: _File(text.encode(), None, "text/html; charset=utf-8", EACH_TIME)}

    async def give(request: Request) -> Response:
        found = files.get(request.path_params.get("path") or INDEX)
        if found is None:
            return Response("There is no such page.\n", 404, media_type="text/plain")
        headers = {"cache-control": found.cache, "vary": "accept-encoding"}
        data = found.data
        if found.packed is not None and "gzip" in request.headers.get("accept-encoding", ""):
            data = found.packed
            headers["content-encoding"] = "gzip"
        return Response(data, 200, headers, media_type=found.type)

    app.add_api_route("/", give, methods=["GET", "HEAD"], include_in_schema=False)
    app.add_api_route("/{path:path}", give, methods=["GET", "HEAD"], include_in_schema=False)


def _files(folder: Path) -> dict[str, _File]:
    found: dict[str, _File] = {}
    for path in folder.rglob("*"):
        if path.is_file():
            name, data = path.relative_to(folder).as_posix(), path.read_bytes()
            kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
            is_text = kind.startswith(PACKED)
            packed = gzip.compress(data, 9) if is_text and len(data) > WORTH_PACKING else None
            cache = FOR_EVER if name.startswith(ASSETS) else EACH_TIME
            found[name] = _File(data, packed, f"{kind}; charset=utf-8" if kind.startswith("text/") else kind, cache)
    return found
