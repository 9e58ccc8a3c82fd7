"""The parts of the tab *Program* in a page, and its buttons."""

from __future__ import annotations

from fake_browser import FakeBrowser


def part(tab: FakeBrowser, name: str) -> str:
    found = [
        m["props"]["content"]
        for m in tab.gui.values()
        if f'data-program="{name}"' in m["props"].get("content", "")
    ]
    return found[0] if found else ""


def press(tab: FakeBrowser, name: str, *index: int, value: object = None) -> None:
    tab.serial = getattr(tab, "serial", 0) + 1  # type: ignore[attr-defined]
    number = tab.say("feature", ["program", [name, *index, tab.serial], value])  # type: ignore[attr-defined]
    tab.wait(lambda: tab.script["reply"][0] >= number)
