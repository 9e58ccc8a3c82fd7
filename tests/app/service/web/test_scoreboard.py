"""The scoreboard of the service: its page, and who may start, follow and cancel a run."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict

import pytest
from fastapi.testclient import TestClient
from starlette.applications import Starlette

from app.bench.board.page import recorded
from app.bench.board.runs import Runs, write_json
from app.service.main import create_app
from app.service.web.scoreboard import Scoreboard
from app.shared.settings import Settings

JSON = {"Content-Type": "application/json"}
ELSEWHERE = {"Origin": "https://elsewhere.example"}
# A run that does nothing until it is killed.
SLEEP = "import time; time.sleep(60)"


@pytest.fixture
def board(tmp_path):
    found = Scoreboard(Settings(bench=True), tmp_path, [sys.executable, "-c", SLEEP])
    with TestClient(Starlette(routes=found.routes())) as client:
        yield client
    found.close()


@pytest.fixture(scope="module")
def closed():
    with TestClient(Starlette(routes=Scoreboard(Settings()).routes())) as client:
        yield client


def test_the_page_and_its_data_are_the_recorded_run(closed):
    page = closed.get("/scoreboard")
    assert (page.status_code, page.headers["cache-control"]) == (200, "no-cache")
    assert recorded()["command"] in page.text
    assert closed.get("/scoreboard.json").json() == recorded()
    assert closed.get("/scoreboard/", follow_redirects=False).headers["location"] == "../scoreboard"


def test_a_run_of_this_machine_is_shown_instead(board, tmp_path):
    own = recorded() | {"command": "kinboard bench of our own"}
    write_json(tmp_path / "result.json", own)
    assert "kinboard bench of our own" in board.get("/scoreboard").text
    assert "the last run on this machine" in board.get("/scoreboard").text
    assert board.get("/scoreboard.json").json() == own


@pytest.mark.parametrize("method", ["GET", "POST", "DELETE"])
def test_without_the_setting_runs_are_refused_in_words(closed, method):
    answer = closed.request(method, "/scoreboard/run", headers=JSON)
    assert answer.status_code == 403
    assert answer.headers["content-type"].startswith("application/problem+json")
    said = answer.json()
    assert said["detail"] == "Visitors may not start runs on this service."
    assert "KINBOARD_BENCH=1" in said["hint"]


def test_a_run_is_started_once_followed_and_cancelled(board):
    assert board.get("/scoreboard/run").json()["state"] == "idle"
    assert board.delete("/scoreboard/run").json()["detail"] == "No run is under way."
    began = board.post("/scoreboard/run", headers=JSON, content="{}")
    assert (began.status_code, began.json()["state"]) == (202, "running")
    assert began.headers["cache-control"] == "no-store"
    assert time.time() - began.json()["started"] < 60
    again = board.post("/scoreboard/run", headers=JSON, content="{}")
    assert (again.status_code, again.json()["detail"]) == (409, "A run is under way already.")
    assert board.delete("/scoreboard/run").status_code == 202


def test_pages_of_other_sites_start_and_cancel_nothing(board):
    assert board.post("/scoreboard/run").status_code == 415
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    assert board.post("/scoreboard/run", headers=form).status_code == 415
    assert board.post("/scoreboard/run", headers={"Content-Type": "text/plain"}).status_code == 415
    for method in ("POST", "DELETE"):
        answer = board.request(method, "/scoreboard/run", headers=JSON | ELSEWHERE)
        assert answer.status_code == 403
        assert answer.json()["detail"] == "Pages of other sites may not start or cancel runs."
    assert board.get("/scoreboard/run").json()["state"] == "idle"
    own = board.post("/scoreboard/run", headers=JSON | {"Origin": "http://testserver"})
    assert own.status_code == 202


def test_who_may_only_look_sees_the_page_and_starts_nothing(tmp_path):
    app = create_app(Settings(bench=True, read_only=True), bench=tmp_path)
    client = TestClient(app)  # without its lifespan: nothing is compiled
    assert client.get("/scoreboard").status_code == 200
    answer = client.post("/scoreboard/run", headers=JSON, content="{}")
    assert (answer.status_code, answer.json()["detail"]) == (403, "This service is read-only.")
    assert client.get("/scoreboard/run").json()["state"] == "idle"


def test_with_a_token_nobody_starts_a_run_without_it(tmp_path):
    client = TestClient(create_app(Settings(token="open sesame", bench=True), bench=tmp_path))
    assert client.post("/scoreboard/run", headers=JSON).status_code == 401
    assert client.get("/scoreboard/run").status_code == 401
    assert client.get("/scoreboard/run", headers={"Authorization": "Bearer open sesame"}).status_code == 200


def test_a_service_that_is_started_again_knows_of_a_run(tmp_path):
    settings = Settings(bench=True)
    first, second = (TestClient(create_app(settings, bench=tmp_path)) for _ in range(2))
    runs = Runs(tmp_path, [sys.executable, "-c", SLEEP])
    try:
        assert runs.start()
        assert first.get("/scoreboard/run").json() == second.get("/scoreboard/run").json() == asdict(runs.status())
        assert second.post("/scoreboard/run", headers=JSON, content="{}").status_code == 409
    finally:
        runs.close()
    assert first.get("/scoreboard/run").json()["state"] == "failed"
    assert tmp_path.is_dir()


def test_a_folder_that_was_cleaned_away_is_made_again(board, tmp_path):
    assert board.get("/scoreboard/run").json()["state"] == "idle"
    (tmp_path / "lock").unlink()
    tmp_path.rmdir()
    assert board.get("/scoreboard/run").json()["state"] == "idle"
    assert board.post("/scoreboard/run", headers=JSON, content="{}").status_code == 202
    assert board.delete("/scoreboard/run").status_code == 202


@pytest.mark.parametrize("method", ["GET", "POST"])
def test_a_folder_that_cannot_be_used_is_503_in_words(board, tmp_path, method):
    tmp_path.rmdir()
    tmp_path.write_text("a file in its place")
    answer = board.request(method, "/scoreboard/run", headers=JSON)
    assert answer.status_code == 503
    assert "cannot be used" in answer.json()["detail"]
