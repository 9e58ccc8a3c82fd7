"""Clients made of the document, in Python and TypeScript: every operation is there, has right types, and works."""

from __future__ import annotations

import importlib
import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import httpx
import playwright._impl._driver as driver
import pytest
from live_server import serve, without_viewer

pytestmark = pytest.mark.full

PACKAGE = "kinboard_client"
INTEGRATE = Path(__file__).parents[4] / "docs" / "integrate.md"
MODULES = Path(sys.prefix) / "lint" / "node_modules"  # where scripts/lint.sh installs what comes from npm
# What a call needs besides the arm and the body.
ASKED = {"code": "AAAA", "n": 10}
# Formats that are no JSON: the generator leaves their answers out and says so.
UNREAD = ("Unsupported content_type application/toml, application/xml", "Unsupported content_type image/png")


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


def block(language: str) -> str:
    """The example in this language that the documentation shows."""
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", INTEGRATE.read_text(encoding="utf-8"), re.M | re.S)
    return found


def operations(document):
    for path, item in document["paths"].items():
        for method, operation in item.items():
            if path.startswith("/api/"):
                yield path, method, operation


def example_of(operation):
    """The first example of a request's body; None for an operation without one."""
    content = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
    return next((each["value"] for each in content.get("examples", {}).values()), None)


def test_nothing_in_the_document_is_beyond_the_generator(made):
    parts = made[1].split("WARNING")[1:]
    warnings = [part for part in parts if not any(unread in part for unread in UNREAD)]
    assert warnings == []
    assert "Unable to" not in made[1]


def test_every_operation_has_a_function_that_works(package, app, client):
    kit = importlib.import_module(f"{PACKAGE}.client")
    caller = kit.Client(base_url="http://testserver")
    caller.set_httpx_client(httpx.Client(base_url="http://testserver", transport=ToTheApplication(client)))
    called = set()
    for _, _, operation in operations(app.openapi()):
        name = operation["operationId"]
        module = importlib.import_module(f"{PACKAGE}.api.{operation['tags'][0]}.{name}")
        parameters = inspect.signature(module.sync_detailed).parameters
        given = {"robot_id": "pioneer5", **ASKED}
        given = {key: given[key] for key in parameters if key in given}
        if "body" in parameters:
            schema = operation["requestBody"]["content"]["application/json"]["schema"]
            model = getattr(module, schema["$ref"].rsplit("/", 1)[1])
            given["body"] = model.from_dict(example_of(operation))
        answer = module.sync_detailed(client=caller, **given)
        assert answer.status_code == 200, f"{name}: {answer.content[:300]!r}"
        called.add(name)
    assert len(called) >= 34


def test_its_types_hold_in_a_program_that_uses_them(package):
    (package / "use.py").write_text(block("py"), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "--no-incremental", "use.py"],
        cwd=package,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


PROGRAM = """\
import createClient from "openapi-fetch";
import type { paths } from "./api";

declare const process: { argv: string[] };
const client = createClient<paths>({ baseUrl: process.argv[2] });
const answers: Record<string, number> = {};
CALLS
const { data } = await client.POST("/api/v1/robots/{robot_id}/ik", {
  params: { path: { robot_id: "pioneer5" } },
  body: { target: { position: [0.045, 0.191, -0.211] } },
});
if (data && "solutions" in data) answers["solutions"] = data.solutions.length;
console.log(JSON.stringify(answers));
"""
CALL = """\
answers["{name}"] = (await client.{method}("{path}", {{ {given}, parseAs: "text" }})).response.status;"""


def calls(document):
    """A call of each operation, with the body of its example."""
    for path, method, operation in operations(document):
        asked = {each["name"]: each["in"] for each in operation.get("parameters", [])}
        values = {"robot_id": "pioneer5", **ASKED}
        places = {
            place: {name: values[name] for name, where in asked.items() if where == place and name in values}
            for place in ("path", "query")
        }
        given = f"params: {json.dumps({place: held for place, held in places.items() if held})}"
        if (example := example_of(operation)) is not None:
            given += f", body: {json.dumps(example)}"
        yield CALL.format(name=operation["operationId"], method=method.upper(), path=path, given=given)


def run_node(*arguments: str, cwd: Path) -> str:
    node = str(driver.compute_driver_executable()[0])
    done = subprocess.run([node, *arguments], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_typescript_program_with_every_operation_has_right_types_and_works(app, tmp_path):
    document = app.openapi()
    (tmp_path / "node_modules").symlink_to(MODULES)
    (tmp_path / "package.json").write_text('{"type": "module"}', encoding="utf-8")
    (tmp_path / "openapi.json").write_text(json.dumps(document), encoding="utf-8")
    generate = ["openapi.json", "-o", "api.d.ts", "--default-non-nullable=false"]  # a default may be left out
    run_node("node_modules/openapi-typescript/bin/cli.js", *generate, cwd=tmp_path)
    program = PROGRAM.replace("CALLS", "\n".join(calls(document)))
    (tmp_path / "use.ts").write_text(program, encoding="utf-8")
    (tmp_path / "shown.ts").write_text(block("ts"), encoding="utf-8")
    options = ["--strict", "--target", "es2022", "--module", "esnext", "--moduleResolution", "bundler"]
    run_node(
        "node_modules/typescript/bin/tsc", *options, "--lib", "es2022,dom", "use.ts", "shown.ts", cwd=tmp_path
    )

    with serve(without_viewer(app)) as port:
        answers = json.loads(run_node("use.js", f"http://127.0.0.1:{port}", cwd=tmp_path))
    assert answers.pop("solutions") >= 1
    assert set(answers) == {operation["operationId"] for _, _, operation in operations(document)}
    assert {name: status for name, status in answers.items() if status != 200} == {}
