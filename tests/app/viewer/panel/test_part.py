"""Blocks of HTML that come by the channel: what is sent, and what is forgotten."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
from fake_browser import FakeBrowser

from app.viewer.panel.part import add_html, bring_parts

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")


class Shown:
    """A channel that keeps what it is given."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []

    def show(self, key: str, value: object) -> None:
        self.calls.append((key, value))

    def forget(self, key: str) -> None:
        self.calls.append((key,))


def gui() -> Any:
    """A panel of viser's that keeps its blocks."""
    made = Mock()
    made.blocks, made.removes = [], []

    def add(content: str, order: float | None = None) -> Any:
        made.removes.append(Mock())
        block = SimpleNamespace(content=content, order=order, visible=True, remove=made.removes[-1])
        made.blocks.append(block)
        return made.blocks[-1]

    made.add_html = add
    return made


def test_a_block_has_its_first_html_in_viser_and_later_ones_by_the_channel() -> None:
    panel, channel = gui(), Shown()
    bring_parts(panel, channel)
    removes = panel.removes
    part, other = add_html(panel, "<b>1</b>", 2.0), add_html(panel)
    place, remove = panel.blocks[0], removes[0]
    key = place.content.split('"')[1]
    assert place.content == f'<div data-part="{key}"><b>1</b></div>'
    assert f'data-part="{key}"' not in panel.blocks[1].content
    part.content = "<b>2</b>"
    part.content = "<b>2</b>"
    assert part.content == "<b>2</b>"
    assert channel.calls == [(key, "<b>2</b>")]
    part.visible, part.order = False, 3.0
    assert (place.visible, place.order, part.visible, part.order) == (False, 3.0, False, 3.0)
    part.remove()
    assert remove.called
    assert channel.calls[1:] == [(key,)]
    panel.blocks[1].remove()  # as viser does where the container is removed
    assert removes[1].called
    assert channel.calls[2:] == [(panel.blocks[1].content.split('"')[1],)]
    assert other.content == ""


def test_without_a_channel_viser_shows_it() -> None:
    panel = gui()
    add_html(panel, "<b>1</b>").content = "<b>2</b>"
    assert [block.content for block in panel.blocks] == ["<b>2</b>"]


def test_the_blocks_of_a_lesson_that_is_closed_are_forgotten(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()

        def keys() -> set[str]:
            """Of the HTML that the service would send to a new connection."""
            return {key for key, html in tab.shown.items() if key.startswith("part-") and html is not None}

        left: list[set[str]] = []
        for _ in range(2):  # blocks that stay get their values with the first one
            tab.set("Lesson", "Velocity")
            tab.wait(lambda: 'data-step="1"' in tab.html)
            for serial, at in enumerate(
                (1, 0), 1
            ):  # its first HTML comes with a block, what follows by the channel
                tab.say("feature", ["guide", ["go", serial], at])
                tab.wait(lambda at=at: f'data-step="{at + 1}"' in tab.html)
            tab.settle()
            opened = keys()
            tab.set("Lesson", "None")
            tab.wait(lambda: 'data-step="1"' not in tab.html)
            tab.settle()
            left.append(keys())
            assert opened - left[-1]
        assert left[0] == left[1]
