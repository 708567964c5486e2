"""REST for programs that look and act now and then: the requests of the WebSocket, each with its own address.

Routes and their descriptions are made from the tables of requests.
"""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from functools import cache, partial
from pathlib import PurePath
from typing import Any, NamedTuple, TypeAlias

from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse

from steptwin import __version__
from steptwin.access.control import Viewer
from steptwin.access.roles import Role
from steptwin.controller import Nanos
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.eventloop import result_of
from steptwin.later import start
from steptwin.messages import Message
from steptwin.studio.hub import Hub
from steptwin.studio.modelfiles import ModelFiles
from steptwin.studio.requests import ALL, OF_CONNECTION, permit_of
from steptwin.studio.schema import answer_schemas
from steptwin.studio.viewersession import STOPS, ViewerSession
from steptwin.subject.commands import COMMANDS
from steptwin.subject.dispatch import LONGEST_REQUEST, JsonObject, failure
from steptwin.subject.schema import definitions, request_schema

_RestEndpoint: TypeAlias = Callable[[Request], Awaitable[Response]]

DONE, MISUSE, NO_TOKEN, FORBIDDEN, REFUSED, TOO_LONG, TOO_MANY, INTERNAL, FAILED = 200, 400, 401, 403, 409, 413, 429, 500, 502
STATUS: Mapping[str, int] = {"misuse": MISUSE, "refusal": REFUSED, "failure": FAILED, "internal": INTERNAL}
STATUS_TEXTS: Mapping[int, str] = {
    DONE: "Done.",
    MISUSE: "The request is wrong; the message says what is permitted.",
    NO_TOKEN: "The token is missing or wrong.",
    FORBIDDEN: "The role of the token may not do this, or the request comes from another site.",
    REFUSED: "This cannot be done now; the message says why.",
    TOO_LONG: "The body is too long.",
    TOO_MANY: "Too many requests.",
    INTERNAL: "An error in steptwin.",
    FAILED: "The line or the device failed.",
}
MOST_POINTS = 1000


class Rest:
    """The routes. All requests with the same token belong to one viewer, and so do all without a token."""

    def __init__(self, hub: Hub, clock: Callable[[], Nanos]) -> None:
        self._hub = hub
        self._clock = clock
        self._sessions: dict[tuple[Role, str | None], ViewerSession] = {}

    def add_to(self, app: FastAPI) -> None:
        words = {name: row.result for name, row in COMMANDS.items()}
        answers = {**words, "describe": {"$ref": "#/$defs/(description)"}, **answer_schemas()}
        for name, row in ALL.items():
            if name not in OF_CONNECTION:
                permit = permit_of(name)
                needs = f" Role {permit.role.title}{', and control' if permit.control else ''}."
                app.add_api_route(
                    f"/api/do/{name}",
                    self._command(name),
                    methods=["POST"],
                    name=name,
                    operation_id=name,
                    summary=row.meaning,
                    description=row.meaning + needs,
                    openapi_extra=_extra(body=_body(name)),
                    responses={**RESPONSES, DONE: _done(answers[name])},
                )
        reading = (
            _Reading("/api/describe", self._describe, "get_describe", "What there is."),
            _Reading("/api/state", self._state, "get_state", "Everything about a controller, or about all.", CONTROLLER),
            _Reading("/api/points", self._points, "get_points", "The present values of points.", POINT_NAMES),
        )
        for one in reading:
            one.add_to(app)
        if self._hub.around.recording_files is not None:
            what = "A saved recording, or an export of one, as a file."
            _Reading("/api/recordings/{file}", self._recording, "get_recording", what, RECORDING_FILE, is_file=True).add_to(app)
        models = self._hub.around.models
        if models is not None:
            what = "The model of a body, as a file."
            _Reading("/api/models/{file:path}", partial(self._model, models), "get_model", what, MODEL_FILE, is_file=True).add_to(
                app
            )
        if self._hub.around.campaigns is not None:
            what = "A file of the results of a campaign."
            _Reading("/api/campaigns/{file:path}", self._result, "get_result", what, RESULT_FILE, is_file=True).add_to(app)

    # ------------------------------------------------------------------ routes

    def _command(self, name: str) -> _RestEndpoint:
        async def do(request: Request) -> Response:
            try:
                fields = await _fields(request)
            except Misuse as error:
                return _response(failure(error), TOO_LONG if isinstance(error, BodyTooLong) else MISUSE)
            return await self._answer(request, name, fields)

        return do

    async def _describe(self, request: Request) -> Response:
        return await self._answer(request, "describe", {})

    async def _state(self, request: Request) -> Response:
        controller = request.query_params.get("controller")
        if controller is not None:
            return await self._answer(request, "state", {"controller": controller})
        names = [part.name for part in self._hub.subject.description.controllers]
        answers = {name: await self._ask(request, "state", {"controller": name}) for name in names}
        for answer, status in answers.values():
            if status != DONE:
                return _response(answer, status)
        found = (await self._ask(request, "time", {}))[0]
        return _response({**found, "ok": {name: answer["ok"] for name, (answer, _) in answers.items()}}, DONE)

    async def _points(self, request: Request) -> Response:
        names = [name for name in request.query_params.get("names", "").split(",") if name]
        return await self._answer(request, "read", {"points": names[: MOST_POINTS + 1]})

    async def _recording(self, request: Request) -> Response:
        name = request.path_params["file"]
        found = await self._file(request, lambda: self._hub.recording_files.file(name))
        return found if isinstance(found, Response) else FileResponse(found, filename=name, media_type=FILE_TYPE, headers=UNKEPT)

    async def _model(self, models: ModelFiles, request: Request) -> Response:
        found = await self._file(request, lambda: models.file(request.path_params["file"]))
        return found if isinstance(found, Response) else FileResponse(found, media_type=FILE_TYPE, headers=UNKEPT)

    async def _result(self, request: Request) -> Response:
        """Pages are shown, without access to the studio; other files are downloads."""
        name = request.path_params["file"]
        found = await self._file(request, lambda: self._hub.campaigns.file(name))
        if isinstance(found, Response):
            return found
        if found.endswith(".html"):
            return FileResponse(found, media_type="text/html", headers={**UNKEPT, "content-security-policy": PAGE_POLICY})
        return FileResponse(found, filename=PurePath(found).name, media_type=FILE_TYPE, headers=UNKEPT)

    async def _file(self, request: Request, find: Callable[[], Coroutine[Any, Any, str]]) -> str | Response:
        """The path of a file, or the answer to a request that does not get one."""
        try:
            self._hub.around.gate.enter(_bearer(request))
        except Refusal as error:
            return _response(failure(error), NO_TOKEN)
        try:
            return await result_of(start(find()))
        except SteptwinError as error:
            answer: Any = failure(error)
            return _response(answer, STATUS[answer["error"]["code"]])

    async def _answer(self, request: Request, name: str, fields: Mapping[str, object]) -> Response:
        return _response(*await self._ask(request, name, fields))

    async def _ask(self, request: Request, name: str, fields: Mapping[str, object]) -> tuple[JsonObject, int]:
        """The answer, and its status."""
        try:
            session = self._session(request, name)
        except Refusal as error:
            return failure(error), NO_TOKEN
        answer = await result_of(session.receive(json.dumps({**fields, "do": name}), self._clock()))
        error: Any = answer.get("error")
        if error is None:
            return answer, DONE
        if name in session.with_token:
            return answer, NO_TOKEN
        is_role = error["code"] == "refusal" and session.viewer.role < permit_of(name).role
        return answer, FORBIDDEN if is_role else STATUS[error["code"]]

    def _session(self, request: Request, wanted: str) -> ViewerSession:
        """Raises `Refusal` for a missing or wrong token; a stop needs none."""
        try:
            role, name = self._hub.around.gate.enter(_bearer(request))
        except Refusal:
            if wanted not in STOPS:
                raise
            role, name = Role.VIEWER, None
        found = self._sessions.get((role, name))
        if found is None:
            viewer = Viewer(self._hub.number(), name or "REST", role)
            found = self._sessions[role, name] = ViewerSession(self._hub, viewer.name, entered=viewer, has_token=name is not None)
        return found


_Parameter: TypeAlias = Mapping[str, object]


def _parameter(name: str, place: str, meaning: str | None = None, *, is_required: bool = True) -> _Parameter:
    head = {"name": name, "in": place, "required": is_required, "schema": {"type": "string", "minLength": 1}}
    return head if meaning is None else {**head, "description": meaning}


CONTROLLER = _parameter("controller", "query", is_required=False)
POINT_NAMES = _parameter("names", "query", "Points with commas between them, such as table.M1.position,time.")
RECORDING_FILE = _parameter("file", "path", "NAME.json: a saved recording; NAME.vcd and so on: what is made of it.")
MODEL_FILE = _parameter("file", "path", "The model of a body in the scene of the description.")
RESULT_FILE = _parameter(
    "file", "path", "The folder of results in the answer to campaigns, and a file there: press.results/report.html."
)


UNKNOWN_PARAMETER = Message("studio.unknown-parameter", "{path}: unknown parameter {name!r}; permitted: {permitted}")


class _Reading(NamedTuple):
    """A route that is read."""

    path: str
    endpoint: _RestEndpoint
    name: str
    summary: str
    parameter: _Parameter | None = None
    is_file: bool = False

    def add_to(self, app: FastAPI) -> None:
        parameters = [] if self.parameter is None else [dict(self.parameter)]
        file: dict[str, Any] = {"response_class": Response} if self.is_file else {}
        app.add_api_route(
            self.path,
            self._answer,
            methods=["GET"],
            name=self.name,
            operation_id=self.name,
            summary=self.summary,
            openapi_extra=_extra(parameters=parameters),
            responses={**RESPONSES, DONE: FILE_RESPONSE} if self.is_file else RESPONSES,
            **file,
        )

    async def _answer(self, request: Request) -> Response:
        """The answer; an error for unknown query parameters, which would change it unnoticed."""
        known = [self.parameter["name"]] if self.parameter is not None and self.parameter["in"] == "query" else []
        for name in request.query_params:
            if name not in known:
                problem = UNKNOWN_PARAMETER(path=self.path, name=name, permitted=", ".join(map(str, known)) or "none")
                return _response(failure(Misuse(problem)), MISUSE)
        return await self.endpoint(request)


OWN = ("do", "id", "version")


class BodyTooLong(Misuse):
    """The body of a request is too long."""

    def __init__(self) -> None:
        super().__init__(f"a body has at most {LONGEST_REQUEST} bytes")


def _bearer(request: Request) -> str | None:
    """The token of a request."""
    scheme, _, given = request.headers.get("authorization", "").partition(" ")
    return given.strip() if scheme.lower() == "bearer" else None


WRONG_BODY = Message(
    "studio.wrong-body", 'a body is an object of JSON with the fields: {{"controller": "table", "axis": 1, ...}}'
)
FIELD_OF_THE_ADDRESS = Message("studio.field-of-the-address", "no field {name!r}: the address says which request it is")


async def _fields(request: Request) -> dict[str, object]:
    """The fields in a body. Raises `Misuse`."""
    data = b""
    async for piece in request.stream():
        data += piece
        if len(data) > LONGEST_REQUEST:
            raise BodyTooLong
    if not data:
        return {}
    try:
        found = json.loads(data)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise Misuse(WRONG_BODY())
    taken = [name for name in OWN if name in found]
    if taken:
        raise Misuse(FIELD_OF_THE_ADDRESS(name=taken[0]))
    return found


def _response(answer: JsonObject, status: int) -> Response:
    headers = {"cache-control": "no-store"} | ({"www-authenticate": "Bearer"} if status == NO_TOKEN else {})
    return Response(json.dumps(answer), status, headers, media_type="application/json")


# ---------------------------------------------------------------------- descriptions


def _local(schema: Any) -> Any:
    """References as they are in an OpenAPI document."""
    if isinstance(schema, dict):
        return {key: _component(value) if key == "$ref" else _local(value) for key, value in schema.items()}
    return [_local(one) for one in schema] if isinstance(schema, list | tuple) else schema


def _component(reference: str) -> str:
    """``#/$defs/(answer)`` there."""
    return f"#/components/schemas/{_named(reference.removeprefix('#/$defs/'))}"


def _named(name: str) -> str:
    """``(answer)`` there."""
    return name.strip("()").capitalize()


RESPONSES: dict[int | str, dict[str, Any]] = {
    status: {"description": text, "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Answer"}}}}
    for status, text in STATUS_TEXTS.items()
}


@cache
def _members_of_answers() -> Mapping[str, object]:
    """Schemas of what an answer has besides its result."""
    answer: Any = definitions()["(answer)"]
    return {name: one for name, one in answer["properties"].items() if name not in ("id", "error")}


def _done(ok: object) -> dict[str, Any]:
    """The response to a request whose answer has the schema ``ok``."""
    properties = {**_members_of_answers(), "ok": _local(ok)}
    schema = {"type": "object", "properties": properties, "required": ["ok", "number", "time_ns"]}
    return {"description": STATUS_TEXTS[DONE], "content": {"application/json": {"schema": schema}}}


FILE_TYPE = "application/octet-stream"
UNKEPT = {"cache-control": "no-store"}
PAGE_POLICY = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data:"
)
"""Policy of pages that a campaign has made: they have no origin, and reach nothing."""
FILE_RESPONSE: dict[str, Any] = {
    "description": "The file.",
    "content": {FILE_TYPE: {"schema": {"type": "string", "format": "binary"}}},
}


def _body(name: str) -> dict[str, object]:
    row = ALL[name]
    found: Any = request_schema(name, row.meaning, row.fields)
    properties = {key: value for key, value in found["properties"].items() if key not in OWN}
    return {**found, "properties": properties, "required": [key for key in found["required"] if key not in OWN]}


def _extra(*, body: Mapping[str, object] | None = None, parameters: list[dict[str, Any]] | None = None) -> dict[str, Any]:
    found: dict[str, Any] = {"parameters": parameters} if parameters else {}
    if body is not None:
        content = {"application/json": {"schema": _local(body)}}
        found["requestBody"] = {"required": bool(body["required"]), "content": content}
    return found


def describe_api(app: FastAPI, *, has_tokens: bool) -> None:
    """Has ``app`` describe itself with the schemas of the tables; ``has_tokens``: a token can be given."""
    from fastapi.openapi.utils import get_openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            found = get_openapi(title="steptwin studio", version=__version__, routes=app.routes)
            schemas = {_named(name): _local(one) for name, one in definitions().items()}
            found.setdefault("components", {})["schemas"] = schemas
            if has_tokens:
                found["components"]["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
                found["security"] = [{"token": []}]
            app.openapi_schema = found
        return app.openapi_schema

    app.openapi = openapi
