"""REST against its own OpenAPI document: schemathesis makes requests up from it and judges every answer.

A few cases of each operation, and sequences of requests with ``-m slow``; KINBOARD_TEST_CASES=300 for thousands.
"""

from __future__ import annotations

import os
from functools import partial

import pytest
import schemathesis
from hypothesis import HealthCheck, settings
from live_server import without_viewer
from schemathesis.config import SchemathesisConfig

import kin
from app.service.main import create_app
from app.shared.settings import Settings

pytestmark = pytest.mark.full

CASES = int(os.environ.get("KINBOARD_TEST_CASES", "6"))
FEW = settings(
    max_examples=CASES, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)
REFUSED = ["400", "404", "405", "413", "415", "422"]
CHECKS = {
    # Busy and too slow are documented answers.
    "not_a_server_error": {"expected-statuses": ["2xx", "3xx", "4xx", "503"]},
    # No schema can tell how many joints this robot has, or that a target needs one of its forms.
    "positive_data_acceptance": {"expected-statuses": ["2xx", "404", "413", "422", "503"]},
    "negative_data_rejection": {"expected-statuses": REFUSED},
}


@pytest.fixture(scope="module")
def contract():
    """The document of an application with small limits, which is asked in this process."""
    service = create_app(Settings(max_batch=20, max_body=100_000, max_points=500, max_path=10, time_budget=5.0))
    service.state.startup.status = "ready"
    for item in service.openapi()["paths"].values():
        for operation in item.values():
            for parameter in operation.get("parameters", []):
                if parameter["name"] == "robot_id":  # any text is an id, but most answers would be 404
                    parameter["schema"]["enum"] = list(kin.files.classic_robots())

    return schemathesis.openapi.from_asgi(
        "/openapi.json", without_viewer(service), config=SchemathesisConfig.from_dict({"checks": CHECKS})
    )


# Tests made from it are subtests: made where they run, and not by every process that collects this file.
schema = schemathesis.pytest.from_fixture("contract")
# Their handlers are those of the operations on arms of the service.
# GET /robots/import and /robots/doctor ask for a robot of that name: 404 instead of 405.
SHADOWED = "unsupported_method"
OF_SENT_ARMS = r"^/api/v1/(?!robots$|robots/\{robot_id\})"


@pytest.fixture(autouse=True)
def quick_answers(monkeypatch):
    """Volumes, fine maps and sections, and searches for pairs of mistakes take seconds.

    Answers have the same fields without them, and arguments are checked before. They are looked at elsewhere.
    """

    def coarse(function, most):
        return lambda *given, **asked: function(*given, **asked | {"resolution": min(asked["resolution"], most)})

    facts = kin.workspace.workspace_facts
    monkeypatch.setattr(
        "app.shared.summaries.workspace_facts",
        lambda robot, **asked: facts(robot, **asked | {"effort": 2, "volume": False}),
    )
    monkeypatch.setattr("app.shared.summaries.workspace_section", coarse(kin.workspace.workspace_section, 16))
    monkeypatch.setattr("app.shared.maps.capability_grid", coarse(kin.workspace.capability_grid, 4))
    monkeypatch.setattr("app.api.arms.compare.compare", partial(kin.compare, seconds=0.1))


@pytest.fixture(autouse=True)
def node_id(request):
    """schemathesis 4.32 names subtests by an attribute that pytest 9.2 has no more."""
    request.node._nodeid = request.node.nodeid


@pytest.mark.slow
def test_so_is_every_answer_in_a_sequence_of_requests(contract):
    """Robots that one answer names are asked about in the next."""
    few = settings(FEW, max_examples=max(CASES, 200), stateful_step_count=6)
    contract.as_state_machine().run(settings=few)


@schema.exclude(path_regex=OF_SENT_ARMS).parametrize()
@FEW
def test_every_answer_is_one_the_document_tells_of(case):
    judge(case)


@schema.include(path=["/api/v1/fk", "/api/v1/robots/import", "/api/v1/robots/doctor"]).parametrize()
@FEW
def test_so_is_every_answer_about_an_arm_sent_along(case):
    judge(case, SHADOWED)


@pytest.mark.slow
@schema.include(path_regex=OF_SENT_ARMS).parametrize()
@FEW
def test_so_is_every_answer_of_the_other_operations_on_such_arms(case):
    judge(case, SHADOWED)


def judge(case, *excluded):
    """The answer is as documented, and a refusal says why."""
    answer = case.call_and_validate(
        excluded_checks=[schemathesis.checks.CHECKS.get_one(name) for name in excluded]
    )
    if answer.status_code >= 400:
        problem = answer.json()
        assert answer.status_code == problem["status"]
        assert problem["detail"]
        if answer.status_code == 422:  # of all kinds the one in which something in particular is wrong
            assert problem["errors"][0]["field"]
