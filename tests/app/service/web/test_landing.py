"""The landing page has a card for each robot of the service."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest
from starlette.applications import Starlette
from starlette.testclient import TestClient

import kin
from app.service.web.pages import page_routes
from app.shared.store import Store

CARD = r'<li class="card"( hidden)?>((?:(?!<li class="card").)*?)</code>'


class Shown(NamedTuple):
    """A card of the page: whether it waits for the button, its HTML, and the robot that its link opens."""

    later: bool
    html: str
    robot: str


def shown(store: Store) -> list[Shown]:
    """The cards of robots, in their order."""
    page = TestClient(Starlette(routes=page_routes(store))).get("/").text
    found = []
    for later, html in re.findall(CARD, page, re.DOTALL):
        (state,) = re.findall(r'href="viewer/#s=([^"]+)"', html)
        found.append(Shown(bool(later), html, json.loads(base64.b64decode(state + "=="))["robot"]))
    return found


@pytest.fixture(scope="module")
def cards() -> list[Shown]:
    return shown(Store())


def test_the_classics_come_first_and_the_library_waits_for_the_button(cards: list[Shown]) -> None:
    classics = list(kin.files.classic_robots())
    assert [card.robot for card in cards if not card.later] == classics
    assert [card.robot for card in cards] == classics + [
        key for key in kin.builtin_robots() if key not in classics
    ]


def test_a_card_says_what_an_arm_has(cards: list[Shown]) -> None:
    html = {card.robot: card.html for card in cards}
    assert "<li>6 joints</li><li>standard DH</li><li>8 postures</li>" in html["ur5"]
    assert "<li>7 joints</li>" in html["panda"]
    assert "<li>redundant</li>" in html["panda"]
    assert 'src="static/robots/ur5.webp"' in html["ur5"]


def test_an_arm_of_the_operator_is_shown_at_once_with_a_drawing_and_its_name_is_no_html(tmp_path: Path) -> None:
    arm = replace(kin.get_robot("planar2r"), id="own-arm", name="<b>Own</b>")
    kin.save_robot(arm, tmp_path / "own-arm.toml")
    (own,) = [card for card in shown(Store(tmp_path)) if card.robot == "own-arm"]
    assert not own.later
    assert "<svg" in own.html
    assert "&lt;b&gt;Own" in own.html
    assert "<b>" not in own.html
