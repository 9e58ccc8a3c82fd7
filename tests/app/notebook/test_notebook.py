"""`kin.show`: the frame of a notebook, and arms that are moved from outside of their pages."""

from __future__ import annotations

import html
import json
import re
import sys
import threading
import urllib.request
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from live_server import wait_for

import app.notebook as notebook
import kin
from app.notebook import child
from app.viewer.session.state import decode
from app.viewer.shown import ShownArms
from kin.notebook import _service

PIONEER = kin.get_robot("pioneer5")
ROBOTS = tuple(kin.files.classic_robots().values())


class Service:
    """Stands for the process that serves a notebook."""

    port = 4321
    alive = True

    def __init__(self) -> None:
        self.sent: list[dict] = []

    def send(self, command: dict) -> None:
        self.sent.append(json.loads(json.dumps(command)))


@pytest.fixture
def service(monkeypatch) -> Service:
    started = Service()
    monkeypatch.setattr(notebook, "_service", started)
    monkeypatch.delenv(notebook.HUB, raising=False)
    return started


def page_of(view: notebook.ArmView):
    source = html.unescape(re.search('src="([^"]*)"', view._repr_html_())[1])
    assert source == view.url
    parts = urlsplit(source)
    return parts, decode(parse_qs(parts.fragment)["s"][0], ROBOTS)


def test_the_frame_shows_the_arm(service) -> None:
    view = notebook.show("pioneer5", None, None, 4.0, True, "100%", 300, None)
    parts, state = page_of(view)
    assert (parts.netloc, parts.path) == ("localhost:4321", "/viewer/")
    assert parse_qs(parts.query)["embed"] == ["panel"]
    assert state.robot == "pioneer5"
    assert np.allclose(state.q, PIONEER.q_home, atol=1e-9)
    assert 'width="100%" height="300"' in view._repr_html_()
    other = notebook.show(PIONEER, None, None, 4.0, False, 400, 300, None)
    assert parse_qs(urlsplit(other.url).query)["embed"] == ["1"]
    assert parse_qs(urlsplit(other.url).query)["shown"] != parse_qs(parts.query)["shown"]


def test_an_arm_that_is_not_built_in(service) -> None:
    own = kin.robot_from_dict({**kin.robot_to_dict(PIONEER), "id": "mine", "name": 'A "new" arm'})
    view = notebook.show(own, own.q_home, None, 4.0, True, 400, 300, None)
    _, state = page_of(view)
    assert state.own.robot.name == 'A "new" arm'
    assert state.robot == state.own.robot.id
    assert 'title="A &quot;new&quot; arm"' in view._repr_html_()


def test_assigning_q_moves_it(service) -> None:
    view = notebook.show(PIONEER, None, None, 4.0, True, 400, 300, None)
    q = PIONEER.q_home + 0.01
    view.q = q
    key = parse_qs(urlsplit(view.url).query)["shown"][0]
    assert service.sent[-1] == {"key": key, "path": [q.tolist()], "seconds": 0.0}
    assert np.allclose(view.q, q)
    assert np.allclose(page_of(view)[1].q, q, atol=1e-9), "a page opened later shows it too"
    for wrong in ([1, 2], [np.nan] * 5, [100.0] * 5):
        with pytest.raises(kin.InputError, match="q"):
            view.q = wrong
    assert np.allclose(view.q, q)


def test_a_path_is_played(service) -> None:
    path = np.stack([PIONEER.q_home, PIONEER.q_home + 0.1])
    view = notebook.show(PIONEER, None, path, 2.0, True, 400, 300, None)
    sent = service.sent[-1]
    assert sent["seconds"] == 2.0
    assert len(sent["path"]) == 60
    assert np.allclose(sent["path"][0], path[0])
    assert np.allclose(sent["path"][-1], path[1])
    assert np.allclose(view.q, path[1])
    with pytest.raises(kin.InputError, match="path"):
        view.play(path[:1])
    with pytest.raises(kin.InputError, match="seconds"):
        view.play(path, 0.0)


def test_the_address_on_a_hub(service, monkeypatch) -> None:
    monkeypatch.setenv(notebook.HUB, "/user/ann/")
    hub = notebook.show(PIONEER, None, None, 4.0, True, 400, 300, None)
    assert hub.url.startswith("/user/ann/proxy/4321/viewer/?embed=panel")
    own = notebook.show(PIONEER, None, None, 4.0, True, 400, 300, "https://lab.example/{port}")
    assert own.url.startswith("https://lab.example/4321/viewer/?")


class Page:
    def __init__(self) -> None:
        self.got: list[tuple[object, object]] = []

    def post(self, key: object, value: object) -> None:
        q, _ = value  # type: ignore[misc]
        self.got.append((key, q.tolist()))


def test_pages_get_what_their_arm_does() -> None:
    arms, page, other = ShownArms(), Page(), Page()
    arms.join("nobody", page.post)
    child.SHOWN, before = arms, child.SHOWN
    try:
        child.follow([json.dumps({"key": "a", "path": [[1.0]], "seconds": 0.0})])
    finally:
        child.SHOWN = before
    arms.join("a", page.post)
    assert page.got == [("shown", [1.0])], "a page that comes later sees what is shown now"
    arms.play("a", [[2.0], [3.0], [4.0]], 0.05)
    wait_for(lambda: page.got[-1][1] == [4.0])
    arms.join("a", other.post)
    assert other.got == [("shown", [4.0])]
    arms.play("b", [[9.0]], 0.0)
    assert other.got == [("shown", [4.0])]
    del other
    arms.play("a", [[5.0]], 0.0)
    assert page.got[-1] == ("shown", [5.0])
    assert len(arms._pages["a"]) == 1, "pages that have gone are forgotten"


def test_a_new_path_ends_the_one_before() -> None:
    arms, page = ShownArms(), Page()
    arms.play("a", [[1.0], [2.0]], 3600.0)  # waits for its first page
    arms.play("a", [[7.0]], 0.0)
    arms.join("a", page.post)
    assert page.got == [("shown", [7.0])]
    assert threading.active_count() < 50


@pytest.mark.full
def test_the_process_serves_and_ends_with_its_input(monkeypatch) -> None:
    for name in ("KINBOARD_TOKEN", "KINBOARD_HOST"):
        monkeypatch.delenv(name, raising=False)
    process = notebook.ServiceProcess()
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{process.port}/livez", timeout=20) as answer:
            assert (
                "frame-ancestors 'self' http://localhost:* http://127.0.0.1:*"
                in answer.headers["content-security-policy"]
            )
        process.send({"key": "a", "path": [[0.0]], "seconds": 0.0})
        assert process.alive
    finally:
        process.close()
    assert not process.alive
    with pytest.raises(kin.KinematicsError, match="has ended"):
        process.send({})


def test_a_checkout_has_one_copy_of_the_service():
    """Also where kinboard is another name of it."""
    assert _service("notebook", "show") is notebook
    assert "kinboard.notebook" not in sys.modules
