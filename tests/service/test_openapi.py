"""Whatever is sent to the REST resources by their own description, nothing breaks (schemathesis)."""

from typing import Any

import pytest

schemathesis = pytest.importorskip("schemathesis", reason="schemathesis is not installed")

from hypothesis import HealthCheck, Phase, given, settings  # noqa: E402

from tests.service.conftest import Server  # noqa: E402

CHECKS = [
    schemathesis.checks.not_a_server_error,
    schemathesis.checks.status_code_conformance,
    schemathesis.checks.content_type_conformance,
    schemathesis.checks.response_schema_conformance,
]


@pytest.mark.parametrize("operation", ["GET /substitutes", "POST /substitutes", "GET /health"])
def test_nothing_breaks(server: Server, operation: str) -> None:
    schema = schemathesis.openapi.from_url(f"{server.url}/openapi.json")
    method, path = operation.split()
    tried = 0

    @settings(
        max_examples=80,
        deadline=None,
        derandomize=True,
        phases=[Phase.explicit, Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(case=schema[path][method].as_strategy())
    def send(case: Any) -> None:
        nonlocal tried
        tried += 1
        response = case.call(timeout=30)
        assert response.status_code < 500, response.text
        case.validate_response(response, checks=CHECKS)

    send()
    assert tried >= (1 if path == "/health" else 50)


def test_all_of_it_is_described(server: Server) -> None:
    found = schemathesis.openapi.from_url(f"{server.url}/openapi.json").get_all_operations()
    described = {f"{one.ok().method.upper()} {one.ok().path}" for one in found}
    assert described == {"GET /substitutes", "POST /substitutes", "GET /health"}
