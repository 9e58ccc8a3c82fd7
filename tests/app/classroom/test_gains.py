"""Before and after: first answers, the normalised gain, and what happens where it has no value."""

from __future__ import annotations

import csv
import html
import io
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import update

from app.classroom import COOKIE, Hub, NewAttempt, Ticket, tables
from app.classroom.courses import Course, Item, parse_course, to_data
from app.classroom.results.gains import (
    COLUMNS,
    Gain,
    Gains,
    csv_of_gains,
    exercises_of,
    gains,
    pairs_of,
    t_quantile,
)
from app.classroom.results.table import Member
from app.classroom.work import ANSWER_SHOWN, Attempt
from app.cli.parser import main
from app.exercises import ExerciseFileError, Exercises
from app.service.main import create_app
from app.shared.settings import Settings
from kin.parsing import to_toml

ALL = Exercises()
PAIRS = [("two-elbows", "other-wrist"), ("swing", "row-distance")]
ITEMS = tuple(Item("exercise", key) for key in ("two-elbows", "swing", "other-wrist", "row-distance"))
COURSE = Course("Week 1", items=ITEMS, before=("two-elbows", "swing"), after=("other-wrist", "row-distance"))
MEMBERS = [Member(f"s{i}", f"Student {i}", i) for i in (1, 2, 3, 4)]


def attempt(seat: int, exercise: str, score: float, at: float, verdict: str = "") -> Attempt:
    return Attempt(f"s{seat}", f"Student {seat}", exercise, int(at), None, verdict, score, at, at, seat)


def test_first_answers_give_the_gains_of_items_students_and_class() -> None:
    attempts = [
        attempt(1, "two-elbows", 0.2, 1),
        attempt(1, "two-elbows", 1.0, 2),
        attempt(1, "swing", 0.0, 3),
        attempt(2, "two-elbows", 1.0, 4),
        attempt(2, "swing", 0.5, 5),
        attempt(3, "swing", 0.25, 6),
        attempt(1, "other-wrist", 0.6, 7),
        attempt(1, "other-wrist", 1.0, 8),
        attempt(1, "row-distance", 1.0, 9),
        attempt(2, "other-wrist", 0.5, 10),
        attempt(2, "row-distance", 0.0, 11, ANSWER_SHOWN),
        attempt(2, "row-distance", 1.0, 12),
    ]
    group, one, two, three = gains(MEMBERS, attempts, PAIRS)
    assert [row.member for row in (group, one, two, three)] == [None, *MEMBERS[:3]], "nobody without an answer"

    assert one.items[0].gain == pytest.approx((0.6 - 0.2) / (1 - 0.2))
    assert one.items[1].gain == 1.0
    assert one.whole.gain == pytest.approx(((0.6 + 1.0) / 2 - 0.1) / (1 - 0.1))
    assert (two.items[0].before, two.items[0].after, two.items[0].gain) == (1.0, 0.5, None), "nothing was missing"
    assert two.items[1].gain == pytest.approx((0.0 - 0.5) / (1 - 0.5)), "who has it shown first has scored 0"
    assert two.whole.gain == pytest.approx((0.25 - 0.75) / (1 - 0.75))
    assert (three.items[1].before, three.items[1].after, three.items[1].gain) == (0.25, None, None)
    assert (three.whole.before, three.whole.students) == (None, 0)

    assert (group.items[0].before, group.items[0].after, group.items[0].students) == (0.6, 0.55, 2)
    assert (group.whole.before, group.whole.after) == pytest.approx(((0.1 + 0.75) / 2, (0.8 + 0.25) / 2))
    assert group.whole.students == 2
    said = [(one.difference, one.gain, one.interval) for one in (*group.items, group.whole)]
    assert said == [(None, None, None)] * 3, "nothing is said of two students"


def test_without_answers_there_is_no_gain() -> None:
    (group,) = gains(MEMBERS, [], PAIRS)
    assert (group.whole, group.items[0].gain) == (Gain(None, None, 0, enough=False), None)
    assert Gain(1.0, 1.0, 1).gain is None
    assert Gain(1.0 - 1e-12, 0.0, 1).gain is None, "no division by what is left of rounding"


def answered(scores: list[tuple[float, float]], exchanged: list[tuple[float, float]]) -> Gains:
    """The class, where each student has these scores of the first pair; the second list in the other order."""
    attempts, time = [], 0.0
    for seat, (order, each) in enumerate([*((1, one) for one in scores), *((-1, one) for one in exchanged)], 1):
        for exercise, score in zip(PAIRS[0][::order], each, strict=True):
            attempts.append(attempt(seat, exercise, score, time := time + 1.0))
    members = [Member(f"s{i}", f"Student {i}", i) for i in range(1, 1 + len(scores) + len(exchanged))]
    return gains(members, attempts, PAIRS)[0]


def test_the_interval_of_one_order_is_that_of_paired_differences() -> None:
    scores = [(0.2, 0.5), (0.4, 0.9), (0.0, 1.0), (0.5, 0.4), (0.3, 0.3), (0.8, 1.0), (0.1, 0.5), (0.6, 0.9)]
    one = answered(scores, []).items[0]
    differences = np.array([after - before for before, after in scores])
    margin = 2.36462 * differences.std(ddof=1) / math.sqrt(8.0)  # Student's t, 7 degrees of freedom
    assert one.difference == pytest.approx(differences.mean())
    assert one.interval == pytest.approx((differences.mean() - margin, differences.mean() + margin), abs=1e-4)
    assert one.gain == pytest.approx(differences.mean() / (1.0 - np.mean([before for before, _ in scores])))
    fewer = answered(scores[1:], []).items[0]
    assert (fewer.difference, fewer.gain, fewer.interval) == (None, None, None), "nothing is said of seven"


def test_a_harder_exercise_is_no_gain_of_a_class_in_two_orders() -> None:
    first, second = [(0.5, 0.6)] * 5, [(0.3, 0.8)] * 3  # 0.3 was gained; the second exercise is harder by 0.2
    one = answered(first, second).items[0]
    assert one.difference == pytest.approx(0.3)
    assert (one.interval, one.orders) == (None, 2), "all of an order have changed alike: the spread is unknown"
    assert (one.before, one.after) == pytest.approx((0.4, 0.7))
    alone = answered(first * 2, []).items[0]
    assert alone.difference == pytest.approx(0.1), "one order alone does not see it"
    assert alone.orders == 1


def test_the_interval_of_two_orders_is_that_of_a_crossover() -> None:
    first = [(0.1, 0.5), (0.3, 0.6), (0.2, 0.9), (0.5, 0.5), (0.4, 0.8)]
    second = [(0.5, 0.6), (0.2, 0.7), (0.1, 0.9), (0.3, 0.3)]
    a, b = (np.array([after - before for before, after in each]) for each in (first, second))
    pooled = (a.var() * 5 + b.var() * 4) / 7
    margin = 2.36462 * math.sqrt(pooled * (1 / 5 + 1 / 4)) / 2
    middle = (a.mean() + b.mean()) / 2
    found = answered(first, second)
    assert found.items[0].interval == pytest.approx((middle - margin, middle + margin), abs=1e-4)
    assert found.whole.interval == found.items[0].interval, "there is one pair alone"


RIGHT_OR_WRONG = [(0.0, 1.0), (1.0, 0.0), (0.0, 0.0), (1.0, 1.0)]  # before and after: of these, two differ alike


@pytest.mark.parametrize("each", [4, 5, 6])
def test_intervals_of_one_question_that_is_right_or_wrong_are_wide_enough(each: int) -> None:
    """Of all classes with so many students in each order; none has an interval without width."""
    orders = [(up, down) for up in range(each + 1) for down in range(each + 1 - up)]

    def students(up: int, down: int) -> list[tuple[float, float]]:
        return [(0.0, 1.0)] * up + [(1.0, 0.0)] * down + [(0.0, 0.0)] * (each - up - down)

    found = {
        (one, two): answered(students(*one), students(*two)).items[0].interval for one in orders for two in orders
    }
    widths = [high - low for low, high in filter(None, found.values())]
    assert min(widths) > 0.2
    for before, after in ((0.5, 0.7), (0.3, 0.8), (0.9, 0.95), (0.6, 1.0)):
        rise, fall = (1.0 - before) * after, before * (1.0 - after)
        chance = {
            (up, down): math.comb(each, up)
            * math.comb(each - up, down)
            * rise**up
            * fall**down
            * (1.0 - rise - fall) ** (each - up - down)
            for up, down in orders
        }
        given = covered = 0.0
        for (one, two), interval in found.items():
            if interval is not None:
                given += chance[one] * chance[two]
                covered += chance[one] * chance[two] * (interval[0] <= after - before <= interval[1])
        assert covered / given >= 0.92, (before, after)


@pytest.mark.parametrize(
    ("freedom", "quantile"), [(6, 2.44691), (8, 2.30600), (10, 2.22814), (30, 2.04227), (198, 1.97202)]
)
def test_quantiles_are_those_of_students_tables(freedom: int, quantile: float) -> None:
    assert t_quantile(0.975, freedom) == pytest.approx(quantile, abs=1e-3)


def test_what_was_answered_first_is_before() -> None:
    attempts = [
        attempt(2, "other-wrist", 0.25, 1),
        attempt(2, "two-elbows", 0.75, 2),
        attempt(3, "row-distance", 1.0, 3),
    ]
    _, two, three = gains(MEMBERS, attempts, PAIRS)
    assert (two.items[0].before, two.items[0].after, two.items[0].exchanged) == (0.25, 0.75, True)
    assert two.whole.exchanged
    assert (three.items[1].before, three.items[1].after, three.items[1].exchanged) == (1.0, None, True)
    rows = list(csv.DictReader(io.StringIO(csv_of_gains([two], PAIRS))))
    assert [(row["before"], row["after"], row["difference"]) for row in rows] == [
        *(("other-wrist", "two-elbows", "0.500"), ("swing", "row-distance", ""), ("", "", "0.500"))
    ]


def test_the_file_has_items_students_and_class() -> None:
    attempts = [attempt(1, "two-elbows", 0.2, 1), attempt(1, "other-wrist", 0.6, 2)]
    members = [Member("s1", "=cmd()", 1)]
    found = list(csv.DictReader(io.StringIO(csv_of_gains(gains(members, attempts, PAIRS), PAIRS))))
    assert tuple(found[0]) == COLUMNS
    assert [(row["student"], row["item"]) for row in found] == [
        *(("class", "1"), ("class", "2"), ("class", "all"), ("1", "1"), ("1", "2"), ("1", "all"))
    ]
    assert found[3]["alias"] == "'=cmd()"
    assert [found[3][name] for name in ("before", "after", "score_before", "score_after", "gain")] == [
        *("two-elbows", "other-wrist", "0.200", "0.600", "0.500")
    ]
    assert (found[4]["gain"], found[4]["students"]) == ("", "0")


# In courses


def test_files_and_links_keep_what_is_compared() -> None:
    assert parse_course(to_toml(to_data(COURSE)), ALL) == COURSE
    assert pairs_of(json.dumps(to_data(COURSE))) == PAIRS
    assert pairs_of("") == pairs_of(json.dumps(to_data(Course("Mine")))) == []
    assert "before" not in to_toml(to_data(Course("Mine", items=ITEMS)))
    assert exercises_of(json.dumps(to_data(COURSE))) == [item.key for item in ITEMS]
    assert exercises_of("") == []


def test_every_second_student_gets_the_pairs_in_the_other_order() -> None:
    items = (Item("lesson", "swing"), replace(ITEMS[0], title="Before"), *ITEMS[1:])
    other = replace(COURSE, items=items).exchanged()
    assert [item.key for item in other.items] == ["swing", "other-wrist", "row-distance", "two-elbows", "swing"]
    assert other.items[1].title == "Before", "the words of a place stay there"
    assert other.exchanged().items == items
    kept = COURSE.exchanged()
    assert parse_course(to_toml(to_data(kept)), ALL) == kept != COURSE
    assert Course("Mine", items=ITEMS).exchanged() == Course("Mine", items=ITEMS)


@pytest.mark.parametrize(
    ("before", "after", "field", "words"),
    [
        (["two-elbows"], [], "after", "as many exercises as before has"),
        (["two-elbow"], ["swing"], "before[0]", "an item of this course"),
        (["two-elbows"], ["puma-wrist"], "after[0]", "an item of this course"),
        (["two-elbows"], ["two-elbows"], "before[0]", "once"),
        (["two-elbows", "two-elbows"], ["swing", "other-wrist"], "before[0]", "once"),
        (["swing"], ["two-elbows"], "after[0]", "comes after swing"),
        ("two-elbows", ["swing"], "before", "a list"),
        ([5], ["swing"], "before[0]", "a text"),
    ],
)
def test_mistakes_are_named(
    before: object, after: object, field: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = to_toml({**to_data(Course("Week 1", items=ITEMS)), "before": before, "after": after})
    with pytest.raises(ExerciseFileError, match=words) as caught:
        parse_course(text, ALL)
    assert f"{field}:" in str(caught.value)
    path = tmp_path / "week.toml"
    path.write_text(text, encoding="utf-8")
    assert main(["check", str(path)]) != 0
    out = capsys.readouterr()
    assert words in out.out + out.err


def test_a_pair_goes_with_its_exercises() -> None:
    fewer = COURSE.removed(1)
    assert (fewer.before, fewer.after) == (("two-elbows",), ("other-wrist",))
    other = COURSE.comparing("two-elbows", "row-distance")
    assert other.before == ("two-elbows", "two-elbows"), "a file refuses that, and so does the editor"
    assert COURSE.comparing("", "other-wrist").before == ("swing",)


# In a room


@pytest.fixture
def service(tmp_path: Path) -> Iterator[object]:
    app = create_app(Settings(data=tmp_path))
    yield app
    app.state.classroom.close()


def send_course(hub: Hub, room: str) -> None:
    """The room follows the course from now on."""
    with hub.database.write() as connection:
        state = {"course": json.dumps(to_data(COURSE))}
        connection.execute(update(tables.Room).where(tables.Room.id == room).values(state=state))


def test_the_results_of_a_room_show_both_and_the_gain(service: object) -> None:
    hub = service.state.classroom  # type: ignore[attr-defined]
    room = hub.rooms.open("Class", 3600.0)

    def browser(ticket: Ticket) -> TestClient:
        cookies = {COOKIE: hub.rooms.tokens.sign(ticket)}
        return TestClient(service, base_url="http://school.example", cookies=cookies)  # type: ignore[arg-type]

    teacher = browser(Ticket(room.id))
    assert "Did they learn?" not in teacher.get("/room/results").text
    send_course(hub, room.id)
    ada = hub.rooms.join(room.code, "<b>Ada")
    for exercise, score in (("two-elbows", 0.25), ("two-elbows", 1.0), ("other-wrist", 0.7)):
        hub.rooms.submit(ada, NewAttempt(exercise, 7, ["30"], "Too large.", score, started=0.0))
    page = teacher.get("/room/results").text
    assert "Did they learn?" in page
    assert "Both elbows → " in page
    assert "25 % → 70 %" in page
    assert f"g = {(0.7 - 0.25) / (1 - 0.25):.2f}" in page
    assert "1 answered both; a gain is said from 8 on" in page
    named = [html.unescape(text) for text in re.findall(r'<b class="of"[^>]*>(.*?)</b>', page)]
    first, second = ([ALL.get(key).title for key in pair] for pair in PAIRS)  # type: ignore[union-attr]
    assert named == 2 * [" → ".join(first), " → ".join(second), "All"], "the names that a phone has in each cell"
    assert "<b>Ada" not in page
    answer = teacher.get("/room/gains.csv")
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.content.decode("utf-8-sig"))))
    assert [row["gain"] for row in rows if row["student"] == "1"] == ["0.600", "", "0.600"]
    for path in ("/room/results", "/room/gains.csv"):
        assert browser(ada).get(path).status_code == 403


def test_a_gain_without_spread_or_in_one_order_says_so(service: object) -> None:
    hub = service.state.classroom  # type: ignore[attr-defined]
    room = hub.rooms.open("Class", 3600.0)
    send_course(hub, room.id)
    cookies = {COOKIE: hub.rooms.tokens.sign(Ticket(room.id))}
    teacher = TestClient(service, base_url="http://school.example", cookies=cookies)  # type: ignore[arg-type]

    def answer(before: float, after: float, order: int = 1) -> None:
        seat = hub.rooms.join(room.code, "Ada")
        for exercise, score in zip(PAIRS[0][::order], (before, after), strict=True):
            hub.rooms.submit(seat, NewAttempt(exercise, 7, ["30"], "Too large.", score, started=0.0))

    def said() -> str:
        """The row of the class."""
        return teacher.get("/room/results").text.split("<table data-gains>")[1].split("</tr>")[1]

    for _ in range(8):
        answer(0.2, 0.5)
    assert "+30 points (no interval: within each order, all changed alike)" in said()
    alone = "all in one order: a harder exercise counts as a loss, an easier one as a gain"
    assert said().count(alone) == 2, "of the pair, and of all"
    answer(0.3, 0.4, order=-1)
    assert "+20 points (no interval" in said()
    assert alone not in said(), "the difficulties cancel"
    answer(0.6, 0.6)
    assert re.search(r"\+18 points \(95 %: [−+]\d+ to \+\d+\)", said())
    assert "no interval" not in said()
    rows = teacher.get("/room/results").text.split("<table data-gains>")[1].split("</tr>")[2:]
    assert not any("points" in row for row in rows), "a student has none"
