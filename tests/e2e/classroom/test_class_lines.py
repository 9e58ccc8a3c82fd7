"""A class on a school's network: reloads, lost lines, two tabs. What is shown says the same of each student."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import pytest
from line import Line
from page import NO_HINTS, PLAIN, WAIT, save_picture
from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, expect
from test_class import Member

from app.exercises import Exercises
from app.viewer.room.member import SURE

pytestmark = [pytest.mark.browser, pytest.mark.full]

EXERCISE, TYPED, OTHER = "which-joint-goes-down", "swing", "which-joint-moved"
TITLE, OTHER_TITLE = Exercises().get(EXERCISE).title, Exercises().get(OTHER).title
RIGHT, WRONG = 2, 0  # choices of this exercise
LOST = ("net::ERR_", "WebSocket connection to")  # what a browser says itself of a line that is lost
BUSY = 3.0  # s that pages drawn in software on a busy machine may be late

# In the order in which they need the teacher, with the symbol on the wall.
SYMBOLS = {"stuck": "!", "gave up": "⚑", "not begun": "○", "at it": "✎", "solved": "✓", "away": "…"}

# Keeps the labels of the scene as the page gets them: what it draws are pixels, which no test can read.
LABELS = """
{
  window.kbLabels = {};
  const note = (message) => {
    const { type, name, props, updates } = message;
    if (type === "LabelMessage") window.kbLabels[name] = props.text;
    if (type === "SceneNodeUpdateMessage" && name in window.kbLabels && "text" in updates) {
      window.kbLabels[name] = updates.text;
    }
    if (type !== "RemoveSceneNodeMessage") return;
    for (const each of Object.keys(window.kbLabels)) {
      if (each === name || each.startsWith(`${name}/`)) delete window.kbLabels[each];
    }
  };
  const { Worker } = window;
  window.Worker = class extends Worker {
    constructor(...parts) {
      super(...parts);
      this.addEventListener("message", ({ data }) => {
        if (data?.type === "message_batch") data.messages.forEach(note);
      });
    }
  };
}
"""
WALL = 'Object.entries(window.kbLabels).filter(([name]) => name.startsWith("/wall-")).map(([, text]) => text)'
# What the teacher's page, the table of results and the file say.
SHOWN = """async () => {
  const plain = (node) => node?.textContent.replace(/\\s+/g, " ").trim() ?? "";
  const read = async (path) => (await fetch(`../room/${path}`, { cache: "no-store" })).text();
  const TABLE = "table:not([data-mistakes], [data-gains])";
  const results = new DOMParser().parseFromString(await read("results"), "text/html");
  return {
    list: [...document.querySelectorAll(".kb-class-list li button")].map((row) => ({
      alias: plain(row.querySelector(".kb-class-alias")),
      words: plain(row.querySelector(".kb-class-where").firstChild),
      said: plain(row.querySelector(".kb-class-said")),
    })),
    chips: plain(document.querySelector(".kb-class-facts")),
    solved: plain(document.querySelector("[data-class-solved]")),
    bar: plain(document.querySelector("[data-class-bar] .kb-class-words")),
    results: [...results.querySelectorAll(`${TABLE} tbody tr`)].map((row) => [...row.children].map(plain)),
    counts: plain(results.querySelector(".lead")),
    file: await read("results.csv"),
  };
}"""
BAR = """() => {
  const bar = document.querySelector("[data-class-bar]");
  const words = bar?.querySelector(".kb-class-words").textContent;
  return [bar?.dataset.classBar ?? "", words?.replace(/\\s+/g, " ").trim() ?? ""];
}"""


@dataclass(frozen=True)
class Truth:
    """What is true of a student.

    Attributes:
        number: 1 for who joined first.
        presence, progress: where the student is, and how far with the task.
        tries: answers so far.
        hand: whether it is up.
        said: the last answer, in words.
        place: what the page shows beside the task.
        gone: whether the student has stopped following.
    """

    number: int
    presence: str = "by themselves"
    progress: str = "not begun"
    tries: int = 0
    hand: bool = False
    said: str = ""
    place: str = ""
    gone: bool = False

    @property
    def came(self) -> bool:
        return self.presence != "not here yet"

    @property
    def here(self) -> bool:
        return self.presence not in ("away", "not here yet")

    @property
    def rank(self) -> tuple[bool, bool, bool, int]:
        """Where the student stands in the list."""
        return not self.came, not self.here, not self.hand, [*SYMBOLS].index(self.progress)

    @property
    def counted(self) -> str:
        return f"{self.tries} {'try' if self.tries == 1 else 'tries'}"

    @property
    def words(self) -> str:
        """In the list."""
        if not self.came:
            return self.presence
        found = [] if self.here else [self.presence]
        found += ["hand up"] if self.hand else []
        found += [self.progress]
        found += [self.counted] if self.tries else []
        if self.here:
            found += ["follows"] if self.presence == "following" else []
            found += ["stopped following"] if self.gone else []
            found += [self.place] if self.place and self.presence != "following" else []
        return " · ".join(found)

    @property
    def wrong(self) -> str:
        """The last answer, as far as it stands in the list."""
        return f"“{self.said}”" if self.said and self.progress != "solved" else ""

    @property
    def mark(self) -> str:
        """In the student's own bar."""
        words = {"not begun": "not begun", "solved": "solved", "gave up": f"{self.counted}, answer shown"}
        return words.get(self.progress, self.counted)

    def label(self, alias: str) -> str:
        """On the wall."""
        state = self.progress if self.here else "away"
        return f"{'☝ ' if self.hand else ''}{alias}\n{SYMBOLS[state]} {state}"


class Wired(Member):
    """A member behind a line of their own."""

    def __init__(
        self, browser: Browser, address: str, code: str = "", alias: str = "", phone: bool = False
    ) -> None:
        self.line, self.alias = Line(address), alias
        super().__init__(browser, self.line.address, code, alias, phone)

    def listen(self, message: ConsoleMessage) -> None:
        if not any(each in message.text for each in LOST):
            super().listen(message)

    def second_tab(self) -> Page:
        """Another tab with the same cookies, and nothing in its own storage."""
        context = self._browser.new_context(storage_state=self.page.context.storage_state())
        tab = context.new_page()
        tab.set_default_timeout(WAIT)
        tab.add_init_script(PLAIN + NO_HINTS + LABELS)
        tab.goto(self.line.address + "viewer/")
        return tab

    def close(self) -> None:
        super().close()
        self.line.close()


class Teacher(Wired):
    """The teacher, with the wall in a second window, as on a projector."""

    def __init__(self, browser: Browser, address: str) -> None:
        super().__init__(browser, address)
        self.wall = self.second_tab()

    def close(self) -> None:
        self.wall.context.close()
        super().close()

    def send(self, task: str) -> None:
        """Send a task."""
        self.page.locator("[data-guide=class-task] select").select_option(task)
        self.page.locator("[data-guide=class-task] [data-guide-do=fields]").click()


class Student(Wired):
    """A student at a desk or with a phone."""

    @property
    def option(self) -> Locator:
        return self.page.locator("[data-exercises=question] [data-guide-do=answer]")

    def sees_task(self) -> None:
        """Wait until the task is open, in front."""
        expect(self.page.locator(f"[data-exercise={EXERCISE}]")).to_be_visible()


class Class:
    """The teacher, two students at desks, one with a phone and one who never comes, and what is true of these."""

    def __init__(self, browser: Browser, address: str) -> None:
        self.address = address
        self.teacher = Teacher(browser, address)
        code = self.teacher.code
        self.ann, self.bob = Student(browser, address, code, "Ann"), Student(browser, address, code, "Bob")
        self.eve = Student(browser, address, code, "Eve", phone=True)
        stranger = browser.new_context()
        joined = stranger.request.post(f"{address}room/join", form={"code": code, "alias": "Dan"})
        assert joined.ok
        stranger.close()
        self.truth = {
            "Ann": Truth(1),
            "Bob": Truth(2),
            "Eve": Truth(3),
            "Dan": Truth(4, presence="not here yet"),
        }
        self.task, self.led = EXERCISE, False

    @property
    def students(self) -> tuple[Student, ...]:
        return self.ann, self.bob, self.eve

    def now(self, alias: str, **news: Any) -> None:
        """Something has become true of a student."""
        self.truth[alias] = replace(self.truth[alias], **news)

    def agrees(self, alias: str = "", **news: Any) -> None:
        """Wait until list, chips, bars, wall, results and file say what is true, the news included."""
        if alias:
            self.now(alias, **news)
        end, wrong = time.monotonic() + WAIT / 1000, "nothing was read"
        while wrong:
            assert time.monotonic() < end, wrong
            time.sleep(0.1)
            shown = self.teacher.page.evaluate(SHOWN)
            wrong = (
                self._list(shown["list"])
                or self._chips(shown["chips"])
                or self._solved(shown["solved"])
                or self._bar(shown["bar"])
                or self._table(shown["results"])
                or self._counts(shown["counts"])
                or self._file(shown["file"])
                or self._wall()
                or self._own_bars()
            )

    def _list(self, rows: list[dict[str, str]]) -> str:
        shown = [(row["alias"], row["words"], row["said"]) for row in rows]
        order = sorted(self.truth, key=lambda alias: self.truth[alias].rank)
        expected = [(alias, self.truth[alias].words, self.truth[alias].wrong) for alias in order]
        # Of equals, the hand that was raised first, or who joined first.
        same = sorted(shown) == sorted(expected) and [self.truth[alias].rank for alias, *_ in shown] == [
            self.truth[alias].rank for alias in order
        ]
        return "" if same else f"the list says {shown} instead of {expected}"

    def _count(self, **wanted: object) -> int:
        came = (one for one in self.truth.values() if one.came)
        return sum(all(getattr(one, key) == value for key, value in wanted.items()) for one in came)

    def _chips(self, chips: str) -> str:
        progress = [each for each in SYMBOLS if each != "away"]
        facts = {each: self._count(progress=each) for each in progress}
        facts |= {"hand up": self._count(hand=True), "away": self._count(presence="away")}
        facts |= {"not here yet": len(self.truth) - self._count()}
        for words, count in facts.items():
            if (f"{count} {words}" in chips) != (count > 0):
                return f"the chips say {chips!r}: {count} {words}"
        return ""

    def _solved(self, said: str) -> str:
        expected = f"{self._count(progress='solved')} of {self._count()} solved it"
        return "" if said == expected else f"the task says {said!r} instead of {expected!r}"

    def _bar(self, bar: str) -> str:
        came, stuck = self._count(), self._count(progress="stuck")
        expected = f"You lead {self._count(presence='following')} of {came} students" if self.led else ""
        if expected not in bar or f"{came} students" not in bar:
            return f"the bar says {bar!r} instead of {expected!r} and {came} students"
        return "" if (f"{stuck} stuck" in bar) == (stuck > 0) else f"the bar says {bar!r}: {stuck} are stuck"

    def _table(self, rows: list[list[str]]) -> str:
        title = Exercises().get(self.task).title
        shown = {row[0]: (row[1], row[3], row[6]) for row in rows if row[2] == title}
        expected = {
            alias: (true.progress if true.came else true.presence, f"{true.tries}", true.said)
            for alias, true in self.truth.items()
        }
        return "" if shown == expected else f"the results say {shown} instead of {expected}"

    def _counts(self, said: str) -> str:
        facts = {each: self._count(progress=each) for each in SYMBOLS if each != "away"}
        for words, count in (facts | {"not here yet": len(self.truth) - self._count()}).items():
            if (f"{count} {words}" in said) != (count > 0 or words in ("stuck", "at it", "solved")):
                return f"the results count {said!r}: {count} {words}"
        return ""

    def _file(self, text: str) -> str:
        rows = [row for row in csv.DictReader(io.StringIO(text.lstrip("\ufeff"))) if row["exercise"] == self.task]
        for alias, true in self.truth.items():
            mine = [row for row in rows if row["seat"] == f"{true.number}"]
            state = mine[-1]["state"] if mine else "not begun"
            shown = state, sum(bool(row["attempt"]) for row in mine), {row["alias"] for row in mine}
            expected = true.progress, true.tries, {alias} if mine else set()
            if shown != expected:
                return f"the file says {shown} of {alias} instead of {expected}"
        return ""

    def _wall(self) -> str:
        shown = sorted(self.teacher.wall.evaluate(WALL))
        expected = sorted(true.label(alias) for alias, true in self.truth.items() if true.came)
        return "" if shown == expected else f"the wall says {shown} instead of {expected}"

    def _own_bars(self) -> str:
        for student in self.students:
            true = self.truth[student.alias]
            if not true.here:
                continue  # its page cannot know
            expected = ["free", f"Task: {Exercises().get(self.task).title}, {true.mark}"]
            if self.led:
                expected = (
                    ["gone", "You stopped following"]
                    if true.gone
                    else ["led", "You follow the teacher Task paused"]
                )
            if (shown := student.page.evaluate(BAR)) != expected:
                return f"the bar of {student.alias} says {shown} instead of {expected}"
        return ""

    def close(self) -> None:
        for member in (self.teacher, *self.students):
            member.close()


@pytest.fixture
def lesson(browser: Browser, address: str) -> Iterator[Class]:
    found = Class(browser, address)
    yield found
    found.close()


def says_no_connection(page: Page, began: float) -> None:
    """Turn the view; the page then says soon that it has none."""
    page.locator("canvas[data-engine]").dispatch_event("wheel", {"deltaY": 60.0})
    expect(page.locator(".kb-class-offline")).to_contain_text("No connection", timeout=8000)
    after = time.monotonic() - began
    print(f"no connection: said after {after:.1f} s")
    assert after < 3.0 + BUSY, "within three seconds"
    assert not page.locator("[data-status]").first.is_visible(), "the page does not look ready"


def offline(lesson: Class, student: Student, seconds: float, anew: bool) -> None:
    """A student answers without a line: both sides say so in time, and the answer arrives when it is back."""
    page, alias = student.page, student.alias
    tries = lesson.truth[alias].tries + 1
    student.line.cut()
    began = time.monotonic()
    says_no_connection(page, began)
    student.option.nth(WRONG).click()
    expect(page.locator(".kb-class-offline")).to_contain_text("Your answer is waiting")
    if seconds > 15:
        lesson.agrees(alias, presence="away")
        after = time.monotonic() - began
        print(f"away after {after:.1f} s")
        assert after < 10.0 + 3.0, "within ten seconds, and three for the reading of all that is compared"
    time.sleep(max(0.0, seconds - (time.monotonic() - began)))
    student.line.mend(anew)
    said = student.option.nth(WRONG).inner_text()
    lesson.agrees(
        alias, presence="by themselves", progress="stuck" if tries >= 3 else "at it", tries=tries, said=said
    )
    expect(page.locator(".kb-class-offline")).to_be_hidden()
    student.sees_task()


def answers(lesson: Class, student: Student, choice: int, **news: Any) -> None:
    """A student answers the task."""
    said = student.option.nth(choice).inner_text()
    student.answer(choice)
    lesson.agrees(student.alias, said=said, tries=lesson.truth[student.alias].tries + 1, **news)


def reload(lesson: Class, member: Member) -> None:
    """Nothing has changed by it."""
    member.page.reload()
    expect(member.status).to_have_attribute("data-status", "hand")
    lesson.agrees()


def begin(lesson: Class) -> None:
    """The teacher sends a task, and opens the wall."""
    teacher = lesson.teacher
    teacher.send(EXERCISE)
    for student in lesson.students:
        student.sees_task()
    expect(teacher.page.locator("[data-guide=class-task] select")).to_have_value(EXERCISE)
    expect(teacher.page.locator(f"[data-class-preview={EXERCISE}]")).to_be_visible()
    teacher.wall.get_by_role("tab", name="Class").click(force=True)
    teacher.wall.locator("[data-guide-do=wall]:visible").first.click(force=True)
    lesson.agrees()


def answer_and_reload(lesson: Class) -> None:
    """Answers and reloads, by Ann at a desk and by Eve with a phone; Bob raises a hand."""
    ann, bob, eve = lesson.students
    for student in (ann, eve):
        answers(lesson, student, WRONG, progress="at it")
        reload(lesson, student)
        student.sees_task()
    bob.do("hand")
    lesson.agrees("Bob", hand=True)


def go_on(lesson: Class) -> None:
    """Two tabs of Ann agree, and she goes on when she has solved the task."""
    ann = lesson.ann
    second = ann.second_tab()
    expect(second.locator(f"[data-exercise={EXERCISE}]")).to_be_visible()
    expect(second.locator("[data-class-bar=free] .kb-class-words")).to_contain_text("1 try")
    answers(lesson, ann, RIGHT, progress="solved")
    expect(second.locator("[data-exercises-solution]")).to_be_visible()
    expect(second.locator("[data-exercises-attempts]")).to_contain_text("2 attempts")
    second.context.close()
    ann.page.locator("[data-guide=exercises] [data-guide-do=list]").first.click()
    lesson.agrees("Ann", place="at the arm")
    ann.page.locator(f"[data-guide-do=open][data-question-key={OTHER}]").click()
    lesson.agrees("Ann", place=OTHER_TITLE)
    ann.do("hand")
    lesson.agrees("Ann", hand=True)


def give_up(lesson: Class) -> None:
    """Bob asks for the answer; the teacher reloads, and gives him an alias that another student has."""
    teacher, bob = lesson.teacher, lesson.bob
    bob.page.locator("[data-guide-do=reveal]").click()
    lesson.agrees("Bob", progress="gave up")
    reload(lesson, bob)
    reload(lesson, teacher)
    teacher.page.locator("[data-guide-do=pick]", has_text="Bob").click()
    card = teacher.page.locator("[data-class-seat]")
    card.get_by_label("Alias").fill("Ann")
    card.get_by_role("button", name="Rename").click()
    expect(teacher.status.first).to_contain_text("Renamed to Ann 2")
    bob.alias = "Ann 2"
    lesson.truth["Ann 2"] = lesson.truth.pop("Bob")
    lesson.agrees()


def lead(lesson: Class) -> None:
    """The teacher leads: exercises are paused. A reload follows on; the teacher's own line is lost."""
    teacher, ann, eve = lesson.teacher, lesson.ann, lesson.eve
    teacher.do("follow")
    lesson.led = True
    for alias in ("Ann", "Ann 2", "Eve"):
        lesson.now(alias, presence="following")
    lesson.agrees()
    for student in lesson.students:
        expect(student.page.locator("[data-exercise]")).to_have_count(0)
    reload(lesson, ann)
    teacher.line.cut()
    says_no_connection(teacher.page, time.monotonic())
    eve.shows("[data-class-bar=paused]")
    teacher.line.mend()
    expect(teacher.page.locator(".kb-class-offline")).to_be_hidden()
    lesson.agrees()
    eve.do("go")
    lesson.agrees("Eve", presence="by themselves", gone=True, place="at the arm")
    eve.do("back")
    lesson.agrees("Eve", presence="following", gone=False, place="")


def end_the_lead(lesson: Class) -> None:
    """Each has the exercise again that was open."""
    teacher, ann = lesson.teacher, lesson.ann
    teacher.do("follow")
    lesson.led = False
    for alias in ("Ann", "Ann 2", "Eve"):
        lesson.now(alias, presence="by themselves")
    lesson.agrees()
    expect(ann.page.locator(f"[data-exercise={OTHER}]")).to_be_visible()
    for student in (lesson.bob, lesson.eve):
        student.sees_task()


def type_and_reload(lesson: Class) -> None:
    """Another task: what is typed stays through a reload and a broken connection."""
    teacher, eve = lesson.teacher, lesson.eve
    teacher.send(TYPED)
    lesson.task = TYPED
    for alias in ("Ann", "Ann 2", "Eve", "Dan"):
        lesson.now(alias, progress="not begun", tries=0, said="", place="")
    lesson.agrees()
    cell = eve.page.locator("[data-exercises=question] [data-cell]")
    cell.fill("12.5")
    reload(lesson, eve)
    expect(cell).to_have_value("12.5")
    eve.line.cut()
    says_no_connection(eve.page, time.monotonic())
    cell.fill("12.75")
    eve.line.mend(anew=True)
    expect(eve.page.locator(".kb-class-offline")).to_be_hidden()
    expect(cell).to_have_value("12.75")
    lesson.agrees()


def end_the_room(lesson: Class) -> None:
    """The end of the room is that of the wall."""
    teacher = lesson.teacher
    teacher.page.locator("[data-guide=class-end] button").click()
    expect(teacher.page.locator("[data-guide=class-end] button")).to_contain_text("Press again")
    teacher.page.wait_for_timeout(1000 * SURE)  # a double click is no second press
    teacher.page.locator("[data-guide=class-end] button").click()
    for student in lesson.students:
        student.shows("[data-class-bar=closed]")
    expect(teacher.wall.locator("[data-class-bar]")).to_contain_text("The room has ended")
    teacher.wall.wait_for_function(f"() => {WALL}.length === 0")


@pytest.mark.parametrize(
    "times", [(5.0,), pytest.param((30.0, 90.0), marks=pytest.mark.slow)], ids=["short", "long"]
)
def test_nothing_is_lost_and_all_that_is_shown_agrees(lesson: Class, times: tuple[float, ...]) -> None:
    begin(lesson)
    answer_and_reload(lesson)
    for i, seconds in enumerate(times):
        offline(lesson, lesson.eve, seconds, anew=i % 2 == 1)
    save_picture(lesson.teacher.page, "class-list")
    for act in (go_on, give_up, lead, end_the_lead, type_and_reload, end_the_room):
        act(lesson)


# Whether the page has written into its link which exercise is open. A long state is compressed, and begins with z.
STORED = """async (name) => {
  const state = new URLSearchParams(location.hash.slice(1)).get("s") ?? "";
  const packed = state.startsWith("z");
  const text = atob((packed ? state.slice(1) : state).replaceAll("-", "+").replaceAll("_", "/"));
  const stream = new Blob([Uint8Array.from(text, (letter) => letter.charCodeAt(0))]).stream();
  const read = packed ? stream.pipeThrough(new DecompressionStream("deflate")) : stream;
  return JSON.stringify(JSON.parse(await new Response(read).text()).features?.exercises ?? "").includes(name);
}"""


def test_a_course_is_where_it_was_after_a_reload(browser: Browser, address: str) -> None:
    """Its list, and an exercise of it with the tries so far, also when the page was closed meanwhile."""
    teacher = Member(browser, address)
    ann = Member(browser, address, teacher.code, "Ann")
    page = ann.page
    teacher.page.locator("[data-guide=class-course] [data-guide-do=fields]").click()
    course = page.locator("[data-course=follow]")
    expect(course).to_be_visible()
    page.reload()
    expect(course).to_be_visible()
    expect(course.locator("[data-course-done]")).to_contain_text("0 of")

    course.locator("[data-guide-do=next]").click()
    exercise = page.locator(f"[data-exercise={EXERCISE}]")
    expect(exercise).to_be_visible()
    page.wait_for_function(STORED, arg=EXERCISE)  # it is sent right after what is on show
    page.reload()
    for tries in (1, 2):
        expect(exercise).to_be_visible()
        expect(page.locator("[data-guide=course-bar]")).to_be_visible()
        ann.answer(WRONG)
        page.reload()
        said = f"{tries} attempt{'s' if tries > 1 else ''}"
        expect(page.locator("[data-exercises-attempts]")).to_contain_text(said)

    # A lead pauses the exercise and returns to it, also where the page was loaded again meanwhile.
    for again in (False, True):
        teacher.do("follow")
        ann.shows("[data-class-bar=led]")
        expect(page.locator("[data-class-paused]")).to_have_text("Exercise paused")
        expect(exercise).to_have_count(0)
        if again:
            page.reload()
            ann.shows("[data-class-bar=led]")
            expect(page.locator("[data-class-paused]")).to_have_text("Exercise paused")
        teacher.do("follow")
        expect(exercise).to_be_visible()
        expect(page.locator("[data-guide=course-bar]")).to_be_visible()

    context = browser.new_context(storage_state=page.context.storage_state())  # without what the tab remembers
    other = context.new_page()
    other.goto(address + "viewer/")
    expect(other.locator("[data-course=follow], [data-guide=course-bar]")).to_be_visible()
    context.close()
    ann.answer(RIGHT)
    page.reload()
    expect(teacher.page.locator(".kb-class-list li button")).to_contain_text("solved · 3 tries")
    page.locator("[data-guide=course-bar] [data-guide-do=list]").click()
    expect(course.locator("[data-course-done]")).to_contain_text("1 of")
    for member in (teacher, ann):
        member.close()
