"""The description of the REST interface, and whether the service keeps to it, tried by schemathesis."""

from __future__ import annotations

from collections.abc import Callable

import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis import checks
from tests.studio.conftest import Process

LEFT_OUT = {"connect", "start_branch"}
"""One opens connections wherever it is asked to, the other starts a process each time: `test_branches` asks for it over REST."""
CHECKS = [
    checks.not_a_server_error,
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_schema_conformance,
]


def test_the_service_keeps_to_its_description(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    schema = schemathesis.openapi.from_url(f"{studio.url}/openapi.json")
    tried = []
    for result in schema.get_all_operations():
        operation = result.ok()  # pyrefly: ignore[missing-attribute]
        if operation.path.rpartition("/")[2] in LEFT_OUT:
            continue
        if operation.method == "post":
            response = operation.definition.raw["responses"]["200"]["content"]["application/json"]["schema"]
            assert response["properties"]["ok"], operation.path

        @settings(max_examples=2, deadline=None, suppress_health_check=list(HealthCheck))
        @given(case=operation.as_strategy())
        def keeps(case: schemathesis.Case) -> None:
            case.call_and_validate(checks=CHECKS)

        keeps()
        tried.append(operation.path)
    assert {"/api/do/move", "/api/do/stop_all", "/api/points", "/api/state"} <= set(tried)
