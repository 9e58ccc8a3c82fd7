"""Exercises that a course brings along: in its file as tables, in links and pages sealed."""

from __future__ import annotations

import base64
import json
import tomllib
import zlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.classroom.courses import Course, Item, Seal, course_of, parse_course, to_data
from app.classroom.courses.course import MOST_OWN
from app.exercises import ExerciseFileError, Exercises, parse_exercise
from kin import InputError, KinematicsError
from kin.parsing import to_toml
from kin.units import Units

ALL = Exercises()
SOURCES = [tomllib.loads(Path(one.file).read_text()) for one in ALL.all]
DATA = {**next(one for one in SOURCES if one["id"] == "planar-tool-point"), "id": "my-own", "title": "My own"}
OWN = parse_exercise(to_toml(DATA))
COURSE = Course("Week 1", "About it.", (Item("lesson", "dh", robot="scara"),)).bringing(OWN)
SEAL = Seal(lambda: b"a secret")


def test_a_course_brings_an_exercise_along_in_its_file_and_sealed() -> None:
    assert COURSE.exercises == ("my-own",)
    again = parse_course(to_toml(to_data(COURSE)), ALL)
    assert again == COURSE
    one = again.own[0].exercise
    assert one.solution(one.variant(7), Units()) == OWN.solution(OWN.variant(7), Units())

    packed = json.loads(json.dumps(to_data(COURSE, SEAL)))
    assert course_of(packed, ALL, seal=SEAL) == COURSE
    assert to_data(COURSE, Seal(lambda: b"a secret")) == packed, "the same in every process"
    text = json.dumps(packed)
    sealed = packed["own"][0]
    raw = base64.urlsafe_b64decode(sealed + "=" * (-len(sealed) % 4))
    for secret in (DATA["answer"]["method"], DATA["hints"][0], "mistakes", "tolerance"):
        assert secret not in text
        assert secret.encode() not in raw
    for start in range(40):
        with pytest.raises(zlib.error):
            zlib.decompress(raw[start:])


@pytest.mark.parametrize("how", ["secret", "changed", "cut", "short", "junk", "unsealed"])
def test_a_seal_that_was_not_made_here_does_not_open(how: str) -> None:
    sealed = SEAL.close(to_toml(DATA))
    seal: Seal | None = SEAL
    if how == "secret":
        seal = Seal(lambda: b"another")
    elif how == "unsealed":
        seal = None
    text = {
        "changed": sealed[:40] + ("A" if sealed[40] != "A" else "B") + sealed[41:],
        "cut": sealed[:-8],
        "short": "AAAA",
        "junk": "ü" * 50,
    }.get(how, sealed)
    data = {"title": "T", "item": [{"exercise": "my-own"}], "own": [text]}
    with pytest.raises(ExerciseFileError) as refused:
        course_of(data, ALL, seal=seal)
    assert refused.value.field == "own[0]"


@given(st.text(max_size=300))
def test_what_is_sealed_opens(text: str) -> None:
    text = text.encode(errors="ignore").decode()
    assert SEAL.open(SEAL.close(text)) == text


@given(st.text(max_size=80))
def test_no_text_opens_by_chance(text: str) -> None:
    with pytest.raises(InputError):
        SEAL.open(text)


def test_without_a_secret_nothing_is_sealed_but_what_was_before() -> None:
    def none() -> bytes:
        raise KinematicsError("no secret")

    with pytest.raises(KinematicsError, match="no secret"):
        to_data(COURSE, Seal(none))
    secrets = iter([b"a secret"] * 2)
    seal = Seal(lambda: next(secrets))
    assert to_data(COURSE, seal) == to_data(COURSE, seal)


def test_refusals_name_the_field_of_the_exercise() -> None:
    def refused(own: object, words: str, field: str) -> None:
        with pytest.raises(ExerciseFileError, match=words) as found:
            course_of({"title": "T", "own": own}, ALL, "week.toml")
        assert found.value.field == field
        assert str(found.value).startswith(f"week.toml: {field}: got ")

    refused([{**DATA, "level": 9}], "a whole number from 1 to 3", "own[0].level")
    refused(
        [{**DATA, "answer": {**DATA["answer"], "value": ["nobody", "y"]}}], "a name from", "own[0].answer.value[0]"
    )
    refused([DATA, DATA], "an id that no other exercise has", "own[1].id")
    refused([{**DATA, "id": "two-elbows"}], "an id that no other exercise has", "own[0].id")
    refused([7], "a table with the fields", "own[0]")
    many = [{**DATA, "id": f"my-{i}"} for i in range(MOST_OWN + 1)]
    refused(many, f"at most {MOST_OWN} in a course", f"own[{MOST_OWN}]")
    long = [
        {**DATA, "id": f"my-{i}", "text": "".join(map(chr, range(700 * i + 500, 700 * i + 1200)))}
        for i in range(8)
    ]
    refused(long, "bytes in all", "item")
    with pytest.raises(ExerciseFileError, match="no numbers that meet the conditions"):
        parse_course(
            to_toml(to_data(Course("T").bringing(parse_exercise(to_toml({**DATA, "require": ["0 > 1"]}))))), ALL
        )


def test_an_exercise_is_replaced_and_goes_with_its_item() -> None:
    other = parse_exercise(to_toml({**DATA, "title": "Other"}))
    changed = COURSE.bringing(other)
    assert [one.exercise.title for one in changed.own] == ["Other"]
    assert len(changed.items) == 2
    assert changed.fingerprint != COURSE.fingerprint, "marks of other questions do not count"
    assert COURSE.removed(1).own == ()
    assert COURSE.removed(0).own == COURSE.own
    assert Course("Week 1", "", COURSE.items[:1]).fingerprint == COURSE.removed(1).fingerprint


def test_a_course_opens_after_another_exercise_was_saved_under_the_same_id(tmp_path: Path) -> None:
    known = Exercises(tmp_path)
    known.save(to_toml({**DATA, "title": "By somebody else"}))
    assert parse_course(to_toml(to_data(COURSE)), known) == COURSE
