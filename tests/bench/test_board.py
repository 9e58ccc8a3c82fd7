"""The scoreboard: the page and the picture of a run."""

from __future__ import annotations

import copy
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import pytest
from fastapi.testclient import TestClient
from starlette.applications import Starlette

from app.bench.board.page import page, recorded
from app.bench.board.picture import NARROW, WIDE, picture, standalone
from app.bench.board.views import busy, facts, sections, summary
from app.bench.board.words import ratio_text, share_text, time_text
from app.service.web.pages import page_routes
from app.shared.store import Store


@pytest.fixture(scope="module")
def document():
    return recorded()


class Tables(HTMLParser):
    """The cells of all tables, by the id of their article; and what the page loads."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.loads, self.open, self.task, self.cell = {}, [], [], "", None
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.loads += [given[name] for name in ("src", "href") if name in given]
        if tag in ("meta", "link", "rect", "path", "circle", "br"):
            return
        self.open.append(tag)
        if tag == "article":
            self.task = given["id"]
        if tag == "tr":
            self.rows.setdefault(self.task, []).append([])
        if tag in ("td", "th"):
            self.rows[self.task][-1].append("")
            self.cell = tag

    def handle_endtag(self, tag):
        if tag in ("rect", "path", "circle"):
            return
        assert self.open.pop() == tag
        if tag in ("td", "th"):
            self.cell = None

    def handle_startendtag(self, tag, attributes):
        self.loads += [value for name, value in attributes if name in ("src", "href")]

    def handle_data(self, text):
        if self.cell:
            self.rows[self.task][-1][-1] += text.strip()


def test_every_figure_of_the_page_is_of_the_run(document):
    tables = Tables(page(document)).rows
    assert list(tables) == [row["id"] for row in document["rows"]]
    for row in document["rows"]:
        head, *lines = tables[row["id"]]
        assert head[2] == f"× {row['reference']}"
        assert len(lines) == len(row["contestants"])
        ratio = "to_array" if row["reference"] == "kinboard" else "to_solve"
        for line, entry in zip(lines, row["contestants"], strict=True):
            assert len(line) == len(head)
            cells = dict(zip(head, line, strict=True))
            assert line[:2] == [entry["name"].removeprefix("floor: "), time_text(entry["median"])]
            assert line[2] == ratio_text(entry[ratio])
            if entry["role"] == "floor":
                continue
            assert cells.get("solved", cells.get("kept")) == share_text(entry["success"])
            if row["kind"] == "branches":
                assert cells["solutions"] == f"{entry['branches']:.2f}"
                assert cells["recall"] == share_text(entry["recall"])
            if entry["derivation"] is not None:
                assert cells["derivation"] == time_text(entry["derivation"])


def test_the_page_says_where_and_when_it_was_measured(document):
    text = page(document)
    machine = document["machine"]
    for said in (machine["time"], machine["processor"], document["command"], document["clock"]):
        assert said in text
    for name, version in document["versions"].items():
        assert f"{name} {version}" in text
    assert dict(facts(document))["Command"].startswith("kinboard bench")


def test_a_file_needs_no_other_file_and_a_service_brings_its_own(document):
    alone = Tables(page(document)).loads
    assert all(place.startswith("#") for place in alone)
    served = Tables(page(document, served=True)).loads
    assert {"static/favicon.svg", "scoreboard.json", "./"} <= set(served)
    assert not any(re.match(r"\w+:|/", place) for place in served)


def test_the_service_shows_the_recorded_run_and_starts_none(document):
    client = TestClient(Starlette(routes=page_routes(Store())))
    shown = client.get("/scoreboard")
    assert (shown.text, shown.headers["cache-control"]) == (page(document, served=True), "no-cache")
    assert client.get("/scoreboard.json").json() == document
    assert client.get("/scoreboard/", follow_redirects=False).headers["location"] == "../scoreboard"
    for method in ("GET", "POST", "DELETE"):
        assert client.request(method, "/scoreboard/run").status_code == 404
    for element in ("<script", "<button"):
        assert element not in shown.text


@pytest.mark.parametrize("layout", [WIDE, NARROW], ids=["wide", "narrow"])
def test_the_picture_has_a_mark_for_every_call_within_its_frame(document, layout):
    found = sections(document)
    drawn = ET.fromstring(picture(found, layout))
    titles = [node.text for node in drawn.iter("{http://www.w3.org/2000/svg}title")]
    shown = [line for section in found for task in section.tasks for line in task.lines if line.role != "floor"]
    assert len(titles) == len(shown)
    width, height = map(float, drawn.get("viewBox").split()[2:])
    for node in drawn.iter("{http://www.w3.org/2000/svg}circle"):
        assert 5 < float(node.get("cx")) < width - 5
        assert 5 < float(node.get("cy")) < height - 5
    for line in shown:
        assert any(said.startswith(f"{line.name}: {line.times}") for said in titles)


def test_marks_do_not_overlap(document):
    drawn = ET.fromstring(picture(sections(document), NARROW))
    marks = [group[1] for group in drawn.iter("{http://www.w3.org/2000/svg}g") if len(group) == 3]
    places = []
    for mark in marks:
        if mark.tag.endswith("circle"):
            places.append((float(mark.get("cx")), float(mark.get("cy"))))
        else:
            places.append((float(mark.get("x")) + 7, float(mark.get("y")) + 7))
    for k, (x, y) in enumerate(places):
        assert all(max(abs(x - a), abs(y - b)) >= 13 for a, b in places[:k])


def test_a_picture_of_its_own_prefers_dark_or_light(document):
    root = ET.fromstring(standalone(document))
    assert "prefers-color-scheme" in "".join(root.itertext())


def test_a_library_that_misses_targets_is_marked_and_not_counted(document):
    spoiled = copy.deepcopy(document)
    row = next(row for row in spoiled["rows"] if row["kind"] == "branches")
    entry = next(entry for entry in row["contestants"] if entry["role"] == "peer")
    entry |= {"success": 0.5, "wrong": 0.0, "to_array": 0.01, "median": 1e-8}
    assert all(
        line.name != entry["name"] or task.id != row["id"] for task, line in summary(sections(spoiled)).faster
    )
    entry["success"] = 1.0
    assert (row["id"], entry["name"]) in [(t.id, line.name) for t, line in summary(sections(spoiled)).faster]
    entry["success"] = 0.5
    tree = picture(sections(spoiled), WIDE)
    assert f'b-hollow"><title>{entry["name"]}: 0.01 ×' in tree


def test_names_are_escaped(document):
    spoiled = copy.deepcopy(document)
    spoiled["command"] = "<script>alert(1)</script>"
    spoiled["rows"][0]["robot_name"] = spoiled["rows"][0]["contestants"][-1]["name"] = "<script>alert(2)</script>"
    assert "<script>alert" not in page(spoiled)


def test_figures_in_words():
    assert [ratio_text(x) for x in (0.186, 1.0, 4.31, 52.4, 274.0, 19500.0)] == [
        *("0.19 ×", "1 ×", "4.3 ×", "52 ×", "270 ×"),
        "20\N{NARROW NO-BREAK SPACE}000 ×",
    ]
    assert [share_text(x) for x in (None, 0.0, 0.0625, 0.9999, 1.0)] == ["", "0 %", "6.25 %", "99.9 %", "100 %"]
    assert [time_text(x) for x in (2e-9, 1.07e-6, 0.0215, 21.0)] == ["2 ns", "1.07 µs", "21.5 ms", "21 s"]
    assert busy({"machine": {"load": "10.5"}})
    assert not busy({"machine": {"load": ""}})
