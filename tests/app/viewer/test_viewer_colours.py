"""The colours of the page: as the visitor's system is, or as the visitor has chosen."""

from __future__ import annotations

import json

import pytest
from fake_browser import FakeBrowser

from app.shared.store import Store
from app.viewer.session.choices import ViewState
from app.viewer.session.state import PageState, decode, encode

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

PIONEER = Store().get("pioneer5")


def memory(view: ViewState, dark: bool) -> str:
    state = encode(PageState("pioneer5", PIONEER.q_home, view=view))
    return json.dumps({"address": "", "state": state, "dark": dark})


def is_dark(tab: FakeBrowser) -> bool:
    tab.settle()
    themes = [m["dark_mode"] for m in tab.log if m["type"] == "ThemeConfigurationMessage"]
    return bool(themes[-1])


@pytest.mark.full
def test_the_page_follows_the_system(port: int) -> None:
    with FakeBrowser(port, memory=memory(ViewState(), dark=True)) as tab:
        assert is_dark(tab)
        tab.say("system-dark", False)
        assert not is_dark(tab)
        assert tab.kept == [], "a link does not contain the colours of the system"
        tab.set("Page colours", "Dark")
        assert is_dark(tab)
        tab.wait(lambda: bool(tab.kept))
        assert decode(tab.kept[-1], [PIONEER]).view.dark is True
        tab.set("Page colours", "Like the system")
        assert not is_dark(tab)
        tab.set("Page colours", "Pink")
        tab.settle()
        assert "one of Like the system, Light, Dark" in tab.html
        assert tab.value("Page colours") == "Like the system"


@pytest.mark.parametrize("chosen", [True, False])
def test_a_choice_outlasts_the_system(port: int, chosen: bool) -> None:
    with FakeBrowser(port, memory=memory(ViewState(dark=chosen), dark=not chosen)) as tab:
        assert is_dark(tab) is chosen
        tab.say("system-dark", chosen)
        tab.say("system-dark", not chosen)
        assert is_dark(tab) is chosen
