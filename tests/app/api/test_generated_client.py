"""A client made of the document by openapi-python-client has every operation; its types hold, and it works."""

from __future__ import annotations

import importlib
import inspect
import json
import subprocess
import sys
import textwrap
from pathlib import Path

import httpx
import pytest

PACKAGE = "kinboard_client"
# What a call needs besides the arm and the body.
ASKED = {"code": "AAAA", "n": 10}
# Formats that are no JSON: the generator leaves their answers out and says so.
UNREAD = "Unsupported content_type application/toml, application/xml"


@pytest.fixture(scope="module")
def made(app, tmp_path_factory) -> tuple[Path, str]:
    """The folder of the package, and what its generator said."""
    folder = tmp_path_factory.mktemp("client")
    (folder / "openapi.json").write_text(json.dumps(app.openapi()), encoding="utf-8")
    (folder / "config.yaml").write_text("post_hooks: []\n", encoding="utf-8")
    options = ["--meta", "none", "--path", "openapi.json", "--config", "config.yaml", "--output-path", PACKAGE]
    program = "from openapi_python_client.cli import app; app()"
    done = subprocess.run(
        [sys.executable, "-c", program, "generate", *options],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder, done.stdout + done.stderr


@pytest.fixture(scope="module")
def package(made) -> Path:
    """The folder of the package, from which it can be imported."""
    sys.path.insert(0, str(made[0]))
    yield made[0]
    sys.path.remove(str(made[0]))
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]


class ToTheApplication(httpx.BaseTransport):
    """Brings the requests of the generated client to the application of the tests."""

    def __init__(self, client) -> None:
        self._client = client

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        answer = self._client.request(
            request.method, str(request.url), content=request.read(), headers=dict(request.headers)
        )
        headers = {"content-type": answer.headers["content-type"]}
        return httpx.Response(answer.status_code, headers=headers, content=answer.content)


def operations(document):
    for path, item in document["paths"].items():
        for operation in item.values():
            if path.startswith("/api/"):
                yield operation


def test_nothing_in_the_document_is_beyond_the_generator(made):
    warnings = [part for part in made[1].split("WARNING")[1:] if UNREAD not in part]
    assert warnings == []
    assert "Unable to" not in made[1]


def test_every_operation_has_a_function_that_works(package, app, client):
    kit = importlib.import_module(f"{PACKAGE}.client")
    caller = kit.Client(base_url="http://testserver")
    caller.set_httpx_client(httpx.Client(base_url="http://testserver", transport=ToTheApplication(client)))
    called = set()
    for operation in operations(app.openapi()):
        name = operation["operationId"]
        module = importlib.import_module(f"{PACKAGE}.api.{operation['tags'][0]}.{name}")
        parameters = inspect.signature(module.sync_detailed).parameters
        given = {"robot_id": "pioneer5", **ASKED}
        given = {key: given[key] for key in parameters if key in given}
        if "body" in parameters:
            content = operation["requestBody"]["content"]["application/json"]
            example = next(iter(content["examples"].values()))["value"]
            model = getattr(module, content["schema"]["$ref"].rsplit("/", 1)[1])
            given["body"] = model.from_dict(example)
        answer = module.sync_detailed(client=caller, **given)
        assert answer.status_code == 200, f"{name}: {answer.content[:300]!r}"
        called.add(name)
    assert len(called) >= 34


def test_its_types_hold_in_a_program_that_uses_them(package):
    (package / "use.py").write_text(
        textwrap.dedent(f"""\
            from {PACKAGE}.api.kinematics import fk, ik
            from {PACKAGE}.api.motion import plan_motion
            from {PACKAGE}.client import Client
            from {PACKAGE}.models.dwell_segment import DwellSegment
            from {PACKAGE}.models.fk_answer import FkAnswer
            from {PACKAGE}.models.fk_request import FkRequest
            from {PACKAGE}.models.motion_answer import MotionAnswer
            from {PACKAGE}.models.motion_request import MotionRequest
            from {PACKAGE}.models.program_body import ProgramBody
            from {PACKAGE}.models.ptp_segment import PtpSegment

            client = Client(base_url="http://127.0.0.1:8000")
            found = fk.sync("pioneer5", client=client, body=FkRequest(q=[0.1, 0.2, 0.3, 0.4, 0.5]))
            if isinstance(found, FkAnswer):
                print(found.pose.position)
            pick = PtpSegment(kind="ptp", q=[1.0, 0.7, 0.9, 0.3, 0.6])
            program = ProgramBody(segments=[pick, DwellSegment(kind="dwell", seconds=1.0)])
            motion = plan_motion.sync("pioneer5", client=client, body=MotionRequest(program=program))
            if isinstance(motion, MotionAnswer):
                print(motion.duration)
            """),
        encoding="utf-8",
    )
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "--no-incremental", "use.py"],
        cwd=package,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
