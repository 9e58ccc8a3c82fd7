"""Result codes: signed, legible, typing errors against forgeries; the teacher's table; CSV without formulas."""

from __future__ import annotations

import csv
import io
import unicodedata
from binascii import crc_hqx
from dataclasses import replace
from datetime import date, timedelta

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from app.classroom.results import ForgedCodeError, MistypedCodeError, Outcome, codes, read_code, write_code
from app.classroom.results.items import MOST, Cause, Item, Reason, items
from app.classroom.results.table import COLUMNS, Member, csv_of, rows
from app.classroom.work import ANSWER_SHOWN, Attempt
from kin import InputError

KEY, OTHER = b"k" * 32, b"o" * 32
ADA = Outcome("course", b"\x01\x02\x03\x04", "First steps", "Ada", 83, 9, 12, 14, date(2026, 11, 23))
CODE = write_code(ADA, KEY)

NAMES = st.text(st.characters(exclude_categories=("C", "Z")), min_size=1, max_size=32).filter(
    lambda text: unicodedata.is_normalized("NFC", text)
)
OUTCOMES = st.builds(
    Outcome,
    st.sampled_from(["exercise", "course"]),
    st.binary(min_size=4, max_size=4),
    st.text(st.characters(exclude_categories=("C",)), max_size=16),
    NAMES,
    st.integers(0, 100),
    st.integers(0, 40),
    st.integers(0, 40),
    st.integers(0, 255),
    st.integers(0, 60_000).map(lambda days: date(2026, 1, 1) + timedelta(days=days)),
)
PLACES = st.integers(0, len(CODE.replace("-", "")) - 1)


@given(OUTCOMES)
def test_a_code_says_what_was_reached(outcome: Outcome) -> None:
    assert read_code(write_code(outcome, KEY), KEY) == outcome


def test_a_code_is_short_and_forgiving() -> None:
    assert len(CODE.replace("-", "")) <= 64
    assert all(len(group) <= 5 for group in CODE.split("-"))
    copies = (
        CODE.lower(),
        CODE.replace("-", " "),
        f"  {CODE}\n",
        CODE.replace("0", "o").replace("1", "l"),
        CODE.replace("-", ""),
    )
    assert [read_code(copy, KEY) for copy in copies] == [ADA] * len(copies)


@settings(max_examples=20)
@given(PLACES, st.sampled_from(codes.LETTERS))
def test_one_wrong_letter_is_a_typing_error_and_its_group_is_named(place: int, letter: str) -> None:
    plain = CODE.replace("-", "")
    assume(plain[place] != letter)
    with pytest.raises(MistypedCodeError, match=f"group {place // 5 + 1}, "):
        read_code(plain[:place] + letter + plain[place + 1 :], KEY)


@settings(max_examples=20)
@given(PLACES, st.sampled_from(["exchange", "drop", "double"]))
def test_exchanged_missing_and_doubled_letters_are_typing_errors(place: int, how: str) -> None:
    plain = CODE.replace("-", "")
    a, b = plain[:place], plain[place:]
    typed = {"exchange": a + b[1:2] + b[:1] + b[2:], "drop": a + b[1:], "double": a + b[:1] + b}[how]
    assume(typed != plain)
    with pytest.raises(MistypedCodeError, match="typing errors"):
        read_code(typed, KEY)


@given(st.integers(0, len(CODE) * 8))
def test_a_changed_code_with_a_right_checksum_is_a_forgery(bit: int) -> None:
    data = bytearray(codes._bytes(CODE.replace("-", "")) or b"")
    place, mask = bit // 8 % (len(data) - 2), 1 << bit % 8
    assume(place)  # the first byte says how to read the rest
    data[place] ^= mask
    data[-2:] = crc_hqx(bytes(data[:-2]), 0xFFFF).to_bytes(2)
    with pytest.raises(ForgedCodeError, match="its checksum is right"):
        read_code(codes._letters(bytes(data)), KEY)


def test_another_services_code_is_not_ours() -> None:
    with pytest.raises(ForgedCodeError, match="made by another service"):
        read_code(CODE, OTHER)


@given(st.text(max_size=500))
@example("")
@example("----")
@example("UUUUU")
@example("0" * 80)
def test_any_other_text_is_refused_with_what_is_valid(text: str) -> None:
    with pytest.raises(MistypedCodeError, match="code: got"):
        read_code(text, KEY)


@pytest.mark.parametrize("alias", ["", "  \n", "x" * 33])
def test_an_alias_has_a_length(alias: str) -> None:
    with pytest.raises(InputError, match="1 to 32 characters"):
        codes.clean_alias(alias)


def test_an_alias_is_one_line() -> None:
    assert codes.clean_alias(" Ada\n\u202eL. ") == "Ada L."


# The table


def attempt(
    seat: str, exercise: str, score: float, at: float, started: float = 0.0, answer: object = 1
) -> Attempt:
    return Attempt(seat, f"alias of {seat}", exercise, 7, answer, "Too large.", score, started, at)


def test_who_needs_the_teacher_comes_first_and_everybody_has_a_row() -> None:
    attempts = [
        attempt("fast", "a", 1.0, 10.0),
        attempt("busy", "a", 0.5, 20.0, started=15.0),
        *(attempt("lost", "a", 0.0, float(at)) for at in range(3)),
        attempt("late", "a", 0.0, 5.0),
        attempt("late", "a", 1.0, 9.0),
        attempt("late", "b", 0.0, 11.0, answer=3),
        replace(attempt("shown", "a", 0.0, 30.0), verdict=ANSWER_SHOWN),
    ]
    names = ("fast", "busy", "lost", "late", "shown", "idle")
    members = [Member(name, name.title(), i) for i, name in enumerate(names)]
    table = rows([*members, Member("ghost", "Ghost", 9, came=False)], attempts, task="a", now=300.0)
    assert [(row.member.seat, row.exercise, row.state) for row in table] == [
        ("lost", "a", "stuck"),
        ("shown", "a", "gave up"),
        ("idle", "a", "not begun"),
        ("late", "b", "at it"),
        ("busy", "a", "at it"),
        ("late", "a", "solved"),
        ("fast", "a", "solved"),
        ("ghost", "a", "not here yet"),
    ]
    assert [row.work.tries for row in table] == [3, 0, 0, 1, 1, 2, 1, 0]
    assert (table[0].seconds, table[-2].seconds, table[2].seconds) == (300.0, 10.0, 0.0)
    assert [(row.work.score, row.work.answer) for row in table[3:5]] == [(0.0, 3), (0.5, 1)]
    (alone,) = rows(members[:1], [], task="", now=1.0)
    assert (alone.exercise, alone.state) == ("", "no answer")


def wrong(seat: str, words: str, at: float = 1.0, cause: str = "", exercise: str = "a") -> Attempt:
    return replace(attempt(seat, exercise, 0.5, at), verdict=words, cause=cause)


def members_of(*seats: str) -> list[Member]:
    return [Member(seat, seat.title(), number) for number, seat in enumerate(seats, 1)]


def test_causes_are_counted_by_student() -> None:
    shown = replace(attempt("cy", "a", 0.0, 5.0), verdict=ANSWER_SHOWN)
    members = members_of("cy", "di", "ed", "flo")
    attempts = [
        *(wrong("ed", "Too small.", 1.0), wrong("di", "Too large.", 2.0), wrong("di", "Too small.", 3.0)),
        *(wrong("di", "Too small.", 4.0), shown, attempt("flo", "a", 1.0, 6.0), attempt("gone", "a", 1.0, 7.0)),
    ]
    (found, other) = items(members, [*attempts, attempt("flo", "b", 1.0, 8.0)])
    assert (found.exercise, found.students, found.first, found.looked) == ("a", 4, 1, 1)
    assert found.causes == (
        Cause("", (Reason("Too small.", ("Di", "Ed")),), 2),
        Cause("", (Reason("Too large.", ("Di",)),), 1),
    )
    assert (other.exercise, other.first, other.causes) == ("b", 1, ()), (
        "an exercise without mistakes is listed, too"
    )
    many = [wrong("di", f"Reason {chr(97 + i)}.", float(i)) for i in range(2 * MOST)]
    assert len(items(members, many)[0].causes) == MOST


def test_a_mistake_with_a_code_is_one_cause_however_it_is_worded() -> None:
    one, two = "The other sign of joint 1.", "The other sign of joint 2."
    given = [wrong("di", one, 1.0, "sign"), wrong("ed", two, 2.0, "sign"), wrong("di", two, 3.0, "sign")]
    known = [wrong("ed", "The elbow is bent.", 4.0, "written"), wrong("di", "That is straight.", 5.0, "written")]
    (found,) = items(members_of("di", "ed"), [*given, *known])
    assert found.causes == (
        Cause("sign", (Reason(two, ("Di", "Ed")), Reason(one, ("Di",))), 2),
        Cause("", (Reason("The elbow is bent.", ("Ed",)),), 1),
        Cause("", (Reason("That is straight.", ("Di",)),), 1),
    )


def test_a_cause_names_each_of_its_students_however_many_wordings_it_has() -> None:
    said = [f"The other sign of joint {i}." for i in range(2 * MOST)]
    seats = [f"s{i}" for i in range(2 * MOST)]
    given = [wrong(seat, words, cause="sign") for seat, words in zip(seats, said, strict=True)]
    (cause,) = items(members_of(*seats), given)[0].causes
    assert cause.students == 2 * MOST
    assert [reason.words for reason in cause.reasons] == said
    assert {name for reason in cause.reasons for name in reason.students} == {seat.title() for seat in seats}


def test_reasons_that_differ_by_the_numbers_of_each_student_are_one() -> None:
    said = ("The sine, 0.5 m, was taken for the cosine.", "The sine, −1.5 m, was taken for the cosine.")
    given = [wrong("di", said[0]), wrong("ed", said[1])]
    assert items(members_of("di", "ed"), given)[0].causes[0].reasons == (Reason(said[0], ("Di", "Ed")),)


def test_a_reason_has_the_numbers_of_its_own_exercise() -> None:
    said = ("You get this with 0.5 m left out.", "You get this with 0.7 m left out.")
    given = [wrong("di", said[0], exercise="y"), wrong("ed", said[1], exercise="z")]
    assert [(one.exercise, one.causes[0].reasons[0].words) for one in items(members_of("di", "ed"), given)] == [
        *(("y", said[0]), ("z", said[1]))
    ]


def test_exercises_are_in_the_order_of_the_course_and_times_are_those_of_first_answers() -> None:
    given = [
        attempt("di", "z", 0.0, 10.0, started=8.0),
        attempt("ed", "y", 1.0, 20.0, started=15.0),
        attempt("ed", "z", 1.0, 30.0, started=20.0),
        attempt("di", "z", 1.0, 90.0, started=10.0),
        replace(attempt("flo", "z", 0.0, 99.0), verdict=ANSWER_SHOWN),
    ]
    found = items(members_of("di", "ed", "flo"), given, order=("x", "y"))
    assert [(one.exercise, one.seconds) for one in found] == [("y", 5.0), ("z", 6.0)]


SEATS = [f"s{i}" for i in range(40)]


def figures(right: dict[str, str]) -> dict[str, Item]:
    """Of exercises that the first of `SEATS` have answered: 1 for right, 0 for wrong, - for not at all."""
    given = [
        attempt(seat, exercise, float(score), float(i))
        for exercise, scores in right.items()
        for i, (seat, score) in enumerate(zip(SEATS, scores, strict=False))
        if score != "-"
    ]
    return {one.exercise: one for one in items(members_of(*SEATS), given)}


def test_the_discrimination_is_the_correlation_with_the_share_right_in_the_rest() -> None:
    found = figures({"a": "11110000", "b": "11100001", "c": "111100--"})
    r = found["a"].discrimination
    x, rest = [1, 1, 1, 1, 0, 0, 0, 0], [1, 1, 1, 0.5, 0, 0, 0, 1]
    assert r == pytest.approx(np.corrcoef(x, rest)[0, 1])
    assert found["c"].discrimination is None, "six students are too few"
    assert figures({"a": "11110000", "b": "11111111"})["a"].discrimination is None, "the rest is the same for all"
    assert figures({"a": "11110000"})["a"].discrimination is None, "there is no rest"


@pytest.mark.parametrize(
    ("item", "rest", "words"),
    [
        ("1" * 19 + "0", "01" * 10, "Too easy"),
        ("1" * 18 + "00", "1" * 10 + "0" * 10, ""),
        ("1" * 4 + "0" * 16, "1" * 10 + "0" * 10, "Too hard"),
        ("1" * 5 + "0" * 15, "1" * 10 + "0" * 10, ""),
        ("1" * 7, "0101010", ""),
        ("0011" * 10, "0101" * 10, "Does not discriminate"),
        ("0011" * 5, "0101" * 5, ""),
        ("0011" * 5, "1100" * 5, "Does not discriminate"),
        ("0011" * 5, "0011" * 5, ""),
    ],
    ids=[
        "easy",
        "less easy",
        "hard",
        "less hard",
        "seven students",
        "chance",
        "perhaps chance",
        "opposite",
        "alike",
    ],
)
def test_items_that_tell_little_are_marked(item: str, rest: str, words: str) -> None:
    found = figures({"a": item, "b": rest})["a"].remark
    assert found.startswith(words)
    assert bool(found) == bool(words)


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("rows 1 and 2 exchanged", "rows 2 and 3 exchanged", False),
        ("rows 1 and 2 exchanged", "rows 1 and 3 exchanged", False),
        ("the other sign of joint 1", "the other sign of joint 2", False),
        ("Joint 1 is outside", "Joint 2 is outside", False),
        ("This is frame 1.", "This is frame 2.", False),
        ("the axis of joint 12 is off by 3°", "the axis of joint 12 is off by 7.5°", True),
        ("the other sign of −0.4 m in row 3", "the other sign of 0,25 m in row 3", True),
        ("joint 2 at 30° and joint 3 at 10°", "joint 2 at 45° and joint 3 at -5°", True),
    ],
)
def test_the_numbers_of_rows_joints_and_frames_are_no_students_own(one: str, other: str, same: bool) -> None:
    members = [Member("d", "Di", 1), Member("e", "Ed", 2)]
    given = [
        replace(attempt(s, "a", 0.0, 1.0), verdict=words) for s, words in zip("de", (one, other), strict=True)
    ]
    assert len(items(members, given)[0].causes) == (1 if same else 2)


@given(st.text(max_size=12), st.text(max_size=12))
@example("=1+1", "-2")
@example("@SUM(A1)", "\t=1")
@example("\r=1", " =1")
@example("\t=", "")
def test_no_cell_is_a_formula(alias: str, answer: str) -> None:
    one = Attempt("s", alias, "two-elbows", 3, answer, alias, 0.5, 0.0, 61.0)
    text = "".join(csv_of([[one]], {"two-elbows": answer}))
    (head, row) = csv.reader(io.StringIO(text, newline=""))
    assert tuple(head) == COLUMNS
    assert len(row) == len(COLUMNS)
    for value in row:
        assert not value.lstrip(" ")[:1] or value.lstrip(" ")[0] not in "=+-@\t\r"
    assert row[0].replace("'", "") == alias.replace("'", "")


def test_the_file_has_the_code_of_the_mistake() -> None:
    given = [wrong("a", "The other sign.", cause="sign"), attempt("a", "a", 1.0, 2.0)]
    found = list(csv.DictReader(io.StringIO("".join(csv_of([given], {})))))
    assert [row["cause"] for row in found] == ["sign", ""]


def test_the_file_tells_students_apart_and_has_the_state_of_the_list() -> None:
    asked = replace(attempt("b", "x", 0.0, 30.0), verdict=ANSWER_SHOWN)
    given = [attempt("a", "x", 0.0, 10.0), attempt("b", "x", 0.0, 20.0), asked, attempt("a", "x", 1.0, 40.0)]
    numbered = [replace(one, alias="Bob", number=1 + (one.seat == "b")) for one in given]
    found = list(csv.DictReader(io.StringIO("".join(csv_of([numbered[:2], numbered[2:]], {})))))
    assert [(row["seat"], row["attempt"], row["state"]) for row in found] == [
        ("1", "1", "at it"),
        ("2", "1", "at it"),
        ("2", "", "gave up"),
        ("1", "2", "solved"),
    ]


def test_each_attempt_is_a_row_and_each_page_a_text() -> None:
    pages = [
        [attempt("a", "x", 0.0, 10.0), attempt("b", "x", 0.25, 20.0, 5.0, ["1 mm", "2"])],
        [attempt("b", "x", 1.0, 30.0)],
    ]
    texts = list(csv_of(pages, {"x": "An exercise"}))
    assert [text.count("\r\n") for text in texts] == [1, 2, 1]
    found = list(csv.DictReader(io.StringIO("".join(texts))))
    assert [(row["alias"], row["attempt"], row["score"]) for row in found] == [
        ("alias of a", "1", "0.00"),
        ("alias of b", "1", "0.25"),
        ("alias of b", "2", "1.00"),
    ]
    assert found[1]["answer"] == '["1 mm","2"]'
    assert (found[1]["started"], found[1]["answered"], found[1]["seconds"]) == (
        "1970-01-01T00:00:05Z",
        "1970-01-01T00:00:20Z",
        "15",
    )
    assert found[0]["title"] == "An exercise"
