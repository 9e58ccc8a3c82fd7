"""REST: the equations of every arm, typeset, and their values."""

import json
import threading
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from pydantic import TypeAdapter

import kin
from app.api.equations import EquationsAnswer, EquationValues
from app.equations import book, book_later, books, chapter
from app.equations.derive import derive
from app.shared.computations import ComputationCache

ROBOTS = tuple(kin.files.classic_robots().values())
each_robot = pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)


def get(client, robot):
    response = client.get(f"/api/v1/robots/{robot.id}/equations")
    assert response.status_code == 200, response.text
    return json.loads(response.text)


def post(client, robot, q):
    response = client.post(f"/api/v1/robots/{robot.id}/equations", json={"q": q})
    assert response.status_code == 200, response.text
    return json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


@each_robot
def test_every_arm_has_its_equations(client, robot):
    answer = get(client, robot)
    assert TypeAdapter(EquationsAnswer).validate_python(answer, strict=True) == answer
    printed = robot.id in chapter.EQUATIONS
    assert answer["source"] == ("chapter" if printed else "derived")
    entries = [equation["name"] for equation in answer["equations"] if equation["name"] != "T"]
    assert sorted(entries) == sorted(f"{column}_{row}" for column in "noap" for row in "xyz")
    if not printed:
        assert entries[:3] == ["p_x", "p_y", "p_z"]
    known = {item["id"] for item in (*answer["symbols"], *answer["lines"])}
    for equation in answer["equations"]:
        assert set(equation["uses"]) <= known
        assert (equation["derived"] is not None) == (not printed)
        assert (equation["reference"] is None) == (not printed)
    formulas = [
        equation[form] for equation in answer["equations"] for form in ("as_printed", "corrected", "derived")
    ]
    formulas += [line["formula"] for line in answer["lines"]]
    for formula in filter(None, (*formulas, *answer["symbols"])):
        assert ET.fromstring(formula["mathml"]).tag.endswith("}math")
        assert formula["latex"].count("{") == formula["latex"].count("}")


@pytest.mark.parametrize("robot_id", list(chapter.EQUATIONS))
def test_the_chapters_equations_are_listed_with_their_verdicts(client, robot_id):
    answer = get(client, kin.get_robot(robot_id))
    for row, equation in zip(answer["equations"], chapter.EQUATIONS[robot_id], strict=True):
        assert (row["reference"], row["name"], row["note"]) == (equation.number, equation.entry, equation.note)
        assert row["verdict"] == equation.verdict
        assert (row["as_printed"] is None) == (equation.verdict == "unreadable")
        wrong = equation.verdict == "misprinted"
        assert (row["corrected"] is not None) == wrong
        assert row["worst_q"] == (list(equation.worst) if wrong else None)


def test_lengths_are_in_metres_and_angles_have_no_value(client):
    symbols = {symbol["id"]: symbol for symbol in get(client, kin.get_robot("pioneer5"))["symbols"]}
    assert (symbols["d6"]["value"], symbols["d6"]["unit"]) == (0.12, "m")
    assert symbols["c23"]["value"] is None
    assert symbols["c23"]["meaning"] == "cos(θ2 + θ3)"
    slide = {symbol["id"]: symbol for symbol in get(client, kin.get_robot("stanford"))["symbols"]}["d3"]
    assert (slide["value"], slide["unit"]) == (None, "m")


@each_robot
def test_values_of_one_and_of_a_list(client, robot):
    q = robot.random_q(np.random.default_rng(0), 300)
    answers = post(client, robot, q.tolist())["results"]
    assert len(answers) == 300
    one = post(client, robot, q[7].tolist())
    assert TypeAdapter(EquationValues).validate_python(one, strict=True) == one
    T = kin.fk(robot, q)
    for k, answer in enumerate(answers):
        for row in answer["values"]:
            equation = book(robot).equation(row["id"])
            assert row["dh"] == T[(k, *equation.index)]
            assert row["corrected"] == pytest.approx(row["dh"], abs=1e-12)
            shown = row["corrected"] if row["printed"] is None else row["printed"]
            assert row["difference"] == pytest.approx(shown - row["dh"], abs=1e-15)
            if equation.verdict != "misprinted":
                assert abs(row["difference"]) < 1e-12
                assert row["turn"] < 1e-12
    for row, again in zip(answers[7]["values"], one["values"], strict=True):
        assert row["dh"] == again["dh"]


def test_a_misprint_shows_in_the_values(client):
    robot = kin.get_robot("pioneer5")
    worst = next(e for e in get(client, robot)["equations"] if e["reference"] == 6)["worst_q"]
    (six,) = [v for v in post(client, robot, worst)["values"] if v["id"] == "6"]
    assert six["difference"] == pytest.approx(-0.13522961568046956)
    assert (six["unit"], six["turn"]) == ("m", 0.0)


@pytest.mark.parametrize(
    ("q", "field"), [([1.0], "q"), ([[0, 0, 0, 0, 0], [1]], "q[1]"), (["a", 0, 0, 0, 0], "q[0]"), (None, "q")]
)
def test_misuse_is_refused_by_name(client, q, field):
    response = client.post("/api/v1/robots/pioneer5/equations", json={"q": q})
    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == field


def test_an_unknown_robot_is_refused(client):
    assert client.get("/api/v1/robots/nobody/equations").status_code == 404


@pytest.mark.usefixtures("computes_here")
def test_a_full_queue_is_said(client, monkeypatch):
    released = threading.Event()
    monkeypatch.setattr(books, "derive", lambda robot: released.wait(30) and derive(robot))
    monkeypatch.setattr(books, "_BOOKS", ComputationCache(ThreadPoolExecutor(1), 4))
    monkeypatch.setattr(books, "MAX_PENDING", 1)
    with book_later(kin.get_robot("ur5")) as first:
        refused = client.get("/api/v1/robots/puma560/equations")
        released.set()
        assert first.future.result(30).source == "derived"
    assert refused.status_code == 503
    assert refused.json()["type"] == "urn:kinboard:problem:busy"
    assert int(refused.headers["retry-after"]) > 0
    assert client.get("/api/v1/robots/puma560/equations").status_code == 200


def test_arms_with_very_many_rows_are_refused(client):
    rows = [{"a": 100, "alpha": 90}] * 2 + [{"kind": "fixed", "a": 1}] * books.MOST_ROWS
    robot = {"convention": "standard", "units": {"length": "mm", "angle": "deg"}, "rows": rows}
    response = client.post("/api/v1/equations/formulas", json={"robot": robot})
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert error["field"] == "robot"
    assert "at most 16 rows, this arm has 18" in error["expected"]
