"""Accessibility, as docs/accessibility.md reports it: the tree for screen readers, the keyboard, and measures."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.exercises.contract import Posed
from app.exercises.lesson_text import texts_of
from app.viewer.lessons import LESSONS
from app.viewer.lessons.equations.lesson import EquationsLesson
from app.viewer.lessons.guide.content import arm_for
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Choice, Number, Question
from kin.units import Units

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")
MEASURE = (Path(__file__).parent / "accessible.js").read_text(encoding="utf-8")
# Without a name, a screen reader says of these nothing but what they are.
NAMED = {
    *("button", "checkbox", "combobox", "columnheader", "heading", "image", "img", "link", "listbox", "menuitem"),
    *("option", "radio", "rowheader", "slider", "spinbutton", "tab", "tabpanel", "table", "textbox"),
}
LISTEN = """() => { // to what is said
  const node = document.getElementById("kb-says"), said = window.kbSaid = [];
  new MutationObserver(() => said.push(node.textContent)).observe(node, { childList: true });
}"""
TABS = ("Move", "Learn", "Robot", "Program", "Workspace", "View")
PRESSES = 120  # of Tab until a control is reached, once around the page


def faults(tab: Tab) -> list[str]:
    """What is wrong with the accessibility tree of the page; new controls get their names a moment later."""
    for _ in range(10):
        if not (found := faults_now(tab)):
            break
        tab.page.wait_for_timeout(300)
    return found


def faults_now(tab: Tab) -> list[str]:
    """The same at once, as the browser computes the tree."""
    session = tab.page.context.new_cdp_session(tab.page)
    nodes: list[dict[str, Any]] = session.send("Accessibility.getFullAXTree")["nodes"]
    session.detach()
    found, levels, count = [], [], Counter[str]()
    for node in nodes:
        if node.get("ignored"):
            continue
        role, name = node["role"]["value"], node.get("name", {}).get("value", "").strip()
        count[role] += 1
        if role in NAMED and not name:
            found.append(f"a {role} without a name")
        if role == "heading":
            levels += [p["value"]["value"] for p in node["properties"] if p["name"] == "level"]
    if count["main"] != 1:
        found.append(f"{count['main']} main parts")
    if levels.count(1) != 1:
        found.append(f"{levels.count(1)} headings of level 1")
    return found


def measured(tab: Tab, what: str) -> list[str]:
    found: list[str] = tab.page.evaluate(MEASURE, what)
    return found


@pytest.mark.full
def test_the_tree_of_every_tab(tab: Tab) -> None:
    found = {}
    for title in TABS:
        tab.open(title)
        found[title] = faults(tab)
    assert {title: wrong for title, wrong in found.items() if wrong} == {}


def test_the_scene_is_described_and_said_once_the_arm_rests(tab: Tab) -> None:
    page = tab.page
    scene, said = page.get_by_role("img", name="Scene with the robot arm"), page.locator("#kb-says")
    description = page.locator("#kb-scene")
    expect(scene).to_have_attribute("aria-describedby", "kb-scene")
    x, y, z = (1000 * kin.fk(PIONEER, PIONEER.q_home)[:3, 3]).tolist()
    home = f"tool at x {x:.1f}, y {y:.1f}, z {z:.1f} mm.".replace("-", "−")
    expect(description).to_contain_text(f"Pioneer arm, front, elbow +, no-flip, {home}")
    assert page.evaluate("document.scrollingElement.scrollHeight") == 720, "it makes the page no longer"

    # While a slider is held, nothing is said, however often the numbers change. Until then, the last press may be.
    slider = page.get_by_role("slider", name="1 rotating base")
    slider.hover()  # once it stands still: words of the status are still coming, and may move it
    thumb = slider.bounding_box()
    assert thumb is not None
    at = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.mouse.down()
    page.evaluate(LISTEN)
    for k in range(1, 16):
        page.mouse.move(at[0] + 3 * k, at[1])
        page.wait_for_timeout(150)
    tab.rest()  # the arm has come after the slider: once it is let go, there is one thing to say
    assert tab.number("1 rotating base") > 90
    assert page.evaluate("kbSaid") == []
    page.mouse.up()
    expect(said).to_contain_text(re.compile("^Tool at x "))
    tool = ", ".join(f"{name} {value:.1f}" for name, value in zip("xyz", tab.tool(), strict=True)).replace(
        "-", "−"
    )
    expect(said).to_contain_text(tool)
    expect(description).to_contain_text(tool)
    assert len(page.evaluate("kbSaid")) == 1

    tab.type_number("1 rotating base", "90")
    page.get_by_role("button", name="Type a target").click()
    page.locator("[data-typed] textarea").fill("900 0 0")
    page.locator("[data-typed] textarea").press("Enter")
    expect(said).to_contain_text("out of reach", ignore_case=True)
    page.keyboard.press("Escape")


class Keys:
    """A visitor who has a keyboard alone."""

    def __init__(self, tab: Tab) -> None:
        self.tab, self.page = tab, tab.page

    def reach(self, selector: str) -> None:
        """Press Tab until a control that matches has the focus."""
        for _ in range(PRESSES):
            if self.page.evaluate("selector => document.activeElement.matches(selector)", selector):
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"no way by Tab to {selector}")

    def press(self, selector: str) -> None:
        self.reach(selector)
        self.page.keyboard.press("Enter")

    def stays(self) -> None:
        """The focus is still on a control, and it is seen."""
        self.page.wait_for_timeout(300)  # what was pressed may be taken away a moment later
        assert self.page.evaluate("document.activeElement !== document.body"), "the focus is lost"
        assert measured(self.tab, "focus") == []

    def answer(self, key: str, question: Question) -> None:
        box, said = f'[data-question="{key}"]', "Right."
        if isinstance(question, Posed):  # the arm stands elsewhere, and is driven there by the answer
            assert question.asked().form == "posture"
            self.press(f"{box} [data-guide-do=posture]")
            self.page.wait_for_function("kbSaid.some((text) => text.includes('Not quite.'))")
            self.press(f"{box} [data-guide-do=reveal]")
            said = "The answer."
        elif isinstance(question, Number):
            self.reach(f"{box} input")
            self.page.keyboard.type(question.value_text)
            self.page.keyboard.press("Enter")
        else:
            assert isinstance(question, Choice)
            right = next(i for i, option in enumerate(question.options) if option.right)
            self.press(f'{box} [data-guide-do=answer][data-argument="{right}"]')
        expect(self.page.locator(box)).to_have_attribute("data-closed", "1")
        self.page.wait_for_function(f"kbSaid.some((text) => text.includes('{said}'))")
        self.page.evaluate("kbSaid.length = 0")
        self.stays()


@pytest.mark.full
def test_a_lesson_by_keyboard_alone_and_the_tree_of_each_step(tab: Tab) -> None:
    tab.reopen()  # another test may have left the lesson at a later step
    page, keys, outline = tab.page, Keys(tab), EquationsLesson.outline(PIONEER, Units())
    page.evaluate(LISTEN)
    page.evaluate("document.activeElement.blur()")
    keys.reach("[role=tab]")
    for _ in TABS:
        if "Learn" in page.evaluate("document.activeElement.textContent"):
            break
        page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    keys.reach("[role=tabpanel] input[aria-label=Lesson], input[aria-haspopup=listbox]:not([value='Pioneer arm'])")
    for _ in range(len(LESSONS) + 2):
        if page.locator("[role=option][data-combobox-selected]", has_text=EquationsLesson.title).count():
            break
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    steps = page.locator("[data-guide=steps]")
    expect(steps).to_have_attribute("data-step", "1")
    keys.stays()
    questions, found = dict(outline.questions()), {}
    for number in range(1, len(outline.steps) + 1):
        expect(steps).to_have_attribute("data-step", str(number))
        keys.stays()
        found[str(number)] = faults(tab)
        for key in (f"e{number}", str(number)):
            if key in questions:
                keys.answer(key, questions[key])
        keys.press(".kb-guide-turn button:last-child")
    expect(steps).to_have_attribute("data-step", "check")
    keys.stays()
    found["check"] = faults(tab)
    for key, question in questions.items():
        if key.startswith("c"):
            keys.answer(key, question)
    count = len(outline.check)
    expect(page.locator("[data-guide=score]")).to_have_text(f"{count} of {count} right")
    keys.press(".kb-guide-turn button:last-child")  # starts again: other tests answer it too
    expect(steps).to_have_attribute("data-step", "1")
    keys.stays()
    assert {step: wrong for step, wrong in found.items() if wrong} == {}


@pytest.mark.slow
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_the_tree_of_each_step_of_every_lesson(tab: Tab, lesson: type[Lesson]) -> None:
    tab.choose_lesson(lesson.title)
    steps = tab.page.locator("[data-guide=steps]")
    expect(tab.page.locator(f'[data-guide=goal][data-lesson="{lesson.title}"]')).to_be_visible()
    found = {}
    for number in range(1, len(lesson.asked(arm_for(texts_of(lesson.key), PIONEER), Units()).steps) + 1):
        tab.page.locator(f'.kb-guide-row [data-guide-do=go][data-argument="{number - 1}"]').click()
        expect(steps).to_have_attribute("data-step", str(number))
        found[number] = faults(tab)
    assert {step: wrong for step, wrong in found.items() if wrong} == {}


@pytest.fixture(params=[(320, 568), (390, 844)], ids=["320x568", "390x844"])
def small(phone: Tab, no_spoilt_page: None, request: pytest.FixtureRequest) -> Iterator[Tab]:
    """The phone with a window of this size; 320 px are a page of 1280 px at 400 %."""
    with phone.sized(*request.param):
        yield phone


def screens(tab: Tab) -> Iterator[str]:
    """Open each tab, and a lesson."""
    for title in TABS:
        tab.open(title)
        yield title
    tab.choose_lesson(EquationsLesson.title)
    expect(tab.page.locator("[data-guide=steps]")).to_be_visible()
    yield "lesson"
    tab.choose("Lesson", "None")


@pytest.mark.full
def test_sizes_spacing_and_reflow_on_a_phone(small: Tab) -> None:
    small.show(PIONEER)
    found: dict[str, list[str]] = {}
    for name in screens(small):
        found[name] = measured(small, "targets") + measured(small, "spacing") + measured(small, "edges")
        found[name] += measured(small, "reflow")
    assert {name: wrong for name, wrong in found.items() if wrong} == {}


def test_sizes_spacing_and_edges_on_a_desk(tab: Tab) -> None:
    found = {
        name: measured(tab, "targets") + measured(tab, "spacing") + measured(tab, "edges") for name in screens(tab)
    }
    assert {name: wrong for name, wrong in found.items() if wrong} == {}


@pytest.mark.full
def test_letter_keys_can_be_switched_off(tab: Tab) -> None:
    page = tab.page
    tab.open("View")
    page.get_by_role("group", name="Keys of a single letter").get_by_role("button", name="Off").click()
    tab.open("Move")
    form = page.locator("[data-typed]")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("t")
    tab.type_number("1 rotating base", "45")  # a later act has arrived: the letter has done nothing
    tab.wait_for_link(PIONEER, 0, 45)
    expect(form).to_be_hidden()
    tab.open("View")
    page.get_by_role("group", name="Keys of a single letter").get_by_role("button", name="On").click()
    tab.open("Move")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("t")
    expect(form).to_be_visible()
    page.keyboard.press("Escape")


@pytest.mark.full
def test_no_control_with_the_focus_is_covered(phone: Tab) -> None:
    phone.show(PIONEER)
    page, covered = phone.page, list[str]()
    page.evaluate("document.activeElement.blur()")
    for _ in range(40):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement !== document.body"):
            covered += measured(phone, "focus")
    assert covered == []


@pytest.mark.full
def test_the_measures_find_what_is_wrong(tab: Tab) -> None:
    tab.page.evaluate("""() => {
        const made = document.createElement("div");
        made.id = "kb-wrong";
        made.style = "position: fixed; top: 200px; left: 200px; z-index: 99; background: #fff";
        const button = '<button style="padding: 0; width: 10px; height: 10px"></button>';
        made.innerHTML = `${button}${button}<input style="border: 1px solid #ddd">`;
        document.body.append(made);
    }""")
    try:
        assert len([wrong for wrong in measured(tab, "targets") if "10 × 10 px" in wrong]) == 2
        assert [wrong for wrong in measured(tab, "edges") if "#ddd" in wrong or wrong.startswith("1.3")]
        tab.page.evaluate(
            "document.querySelector('#kb-wrong').innerHTML += '<img src=\"data:,\"><th></th><a href=\"#\"></a>'"
        )
        assert "a link without a name" in faults(tab)
        tab.page.get_by_role("button", name="Undo").focus()
        tab.page.evaluate(
            "document.querySelector('#kb-wrong').style.cssText = 'position: fixed; inset: 0; z-index: 9999'"
        )
        assert measured(tab, "focus") != []
    finally:
        tab.page.evaluate("document.querySelector('#kb-wrong').remove()")
