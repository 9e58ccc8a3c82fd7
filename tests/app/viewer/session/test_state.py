"""The state of a page as text: round trips, and every other content an address may have."""

from __future__ import annotations

import base64
import copy
import json
import math
import random
import re
import time
import tracemalloc
import zlib
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.security import Rights
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.feature import Feature
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.page.links import Links
from app.viewer.panel import listen
from app.viewer.panel.joints import UNLOCK_ALL, label, lock_buttons
from app.viewer.server import ViewerServer
from app.viewer.session import page
from app.viewer.session.choices import ViewState
from app.viewer.session.persistence import Persistence
from app.viewer.session.state import (
    LONG,
    MAX_TEXT,
    MOST_BYTES,
    PageState,
    decode,
    encode,
    encode_features,
    equal,
    opened_with,
    read_stored_page,
    write,
)
from kin.units import DEFAULT_UNITS, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
ROBOTS = CLASSICS
PUMA, PIONEER = STORE.get("puma560"), STORE.get("pioneer5")
RADIANS_CM = Units(degrees=False, length="cm")


def packed(said: object) -> str:
    return base64.urlsafe_b64encode(json.dumps(said).encode()).rstrip(b"=").decode()


def there(**changes: object) -> PageState:
    """The decoded state of a PUMA page with these entries changed."""
    said = {"v": 1, "robot": "puma560", "q": PUMA.q_home.tolist(), "task": "pose", **changes}
    return decode(packed(said), ROBOTS)


def test_a_state_is_restored_from_text_that_is_safe_in_an_address():
    rng = np.random.default_rng(5)
    q = PUMA.random_q(rng)
    T = kin.fk(PUMA, PUMA.random_q(rng))
    branch = kin.branch_names(PUMA)[2]
    view = ViewState(frames=True, labels=False, dark=True, look="both")
    features = {"w": {"n": 3, "name": "π & <b>"}}
    camera = np.array([[1.5, -2.25, 0.75], [0.1, 0.2, 0.3], [0.0, 0.6, 0.8]])
    state = PageState("puma560", q, T, "approach", branch, "dh", RADIANS_CM, view, features, (1, 4), camera)
    text = encode(state)
    assert set(text) <= set("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_")
    back = decode(text, ROBOTS)
    assert np.abs(back.q - q).max() < 1e-9
    assert np.abs(back.target - T).max() < 1e-8
    assert (back.robot, back.task, back.branch, back.lesson) == ("puma560", "approach", branch, "dh")
    assert (back.units, back.view, back.features, back.locks) == (RADIANS_CM, view, features, (1, 4))
    assert np.abs(back.camera - camera).max() < 1e-9
    assert encode(back) == text


def test_an_address_without_a_unit_of_length_is_in_millimetres():
    assert there().units == DEFAULT_UNITS
    assert there(units="rad").units == Units(degrees=False)
    assert there(length="m").units == Units(length="m")


@pytest.mark.parametrize("length", ["inch", "MM", "", 3, None, True, ["cm"], {"cm": 1}, "cm" * 5000])
def test_an_unknown_unit_is_ignored(length):
    assert there(length=length, units="rad").units == Units(degrees=False)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: r.id)
def test_a_configuration_at_its_limits_comes_back_inside_them(robot):
    for q in (robot.lower, robot.upper):
        q = np.where(np.isfinite(q), q, 0.0)
        back = decode(encode(PageState(robot.id, q)), ROBOTS)
        assert np.abs(back.q - q).max() < 1e-9
        assert robot.in_limits(back.q)


@pytest.mark.parametrize(
    "text",
    [
        *(
            "",
            "%%%",
            "é",
            "A" * (MAX_TEXT + 4),
            packed([1, 2]),
            packed("x"),
            packed({"v": 2, "robot": "ur5"}),
            packed({}),
        ),
        base64.urlsafe_b64encode(b'{"v":1,"q":' + b"[" * 5000).decode(),
        base64.urlsafe_b64encode(b"\xff\xfe\x00").decode(),
        base64.urlsafe_b64encode(b'{"v":1,"robot":"ur5"').decode(),
    ],
)
def test_an_invalid_state_gives_a_fresh_page(text):
    assert encode(decode(text, ROBOTS)) == encode(PageState())


@pytest.mark.parametrize(
    "q",
    [
        *(None, 3, "1,2,3", {}, [], [0.0] * 5, [0.0] * 7, [[0.0] * 6], ["0"] * 6, [True] * 6, [None] * 6),
        *([math.nan] * 6, [math.inf] * 6, [1e308] * 6, [10**400] * 6, [4.0] * 6),
    ],
)
def test_an_invalid_configuration_is_ignored_and_the_rest_is_kept(q):
    state = there(q=q, units="rad")
    assert state.q is None
    assert (state.robot, state.units) == ("puma560", Units(degrees=False))


@pytest.mark.parametrize(
    "target",
    [
        *(7, "x", [0.0] * 6, [0.0] * 7, [0, 0, 0, 1e-200, 0, 0, 0], [0, 0, 0, 1e308, 1e308, 0, 0]),
        *(
            [math.nan, 0, 0, 1, 0, 0, 0],
            [1e9, 0, 0, 1, 0, 0, 0],
            [0, 0, 0, math.inf, 0, 0, 0],
            [0, 0, 0, 1, 0, 0, "0"],
        ),
    ],
)
def test_a_target_that_is_not_a_pose_is_ignored(target):
    assert there(target=target).target is None


@pytest.mark.parametrize(
    ("locks", "kept"),
    [
        *(([2, 0, 2], (0, 2)), ([5], (5,)), ([], ()), ([6, -1, 3], (3,)), ([10**400], ()), ([1.0, "1", None], ())),
        *(([True, [1]], ()), ("12", ()), (3, ()), ({"1": 1}, ()), (None, ())),
    ],
)
def test_only_joints_of_the_arm_are_restored_as_locked(locks, kept):
    assert there(locks=locks).locks == kept


@pytest.mark.parametrize(
    "camera",
    [
        *(7, "x", {}, [], [1.0] * 5, [2, 2, 2, 0, 0, 0, 1], [[2, 2, 2], [0, 0, 0]], ["2"] * 6, [None] * 6),
        *([math.nan, 2, 2, 0, 0, 0], [2, 2, math.inf, 0, 0, 0], [True, 2, 2, 0, 0, 0], [1e308] * 3 + [-1e308] * 3),
        *([1, 1, 1, 1, 1, 1], [0, 0, 1e-3, 0, 0, 0], [300, 0, 0, 0, 0, 0], [302, 0, 0, 300, 0, 0]),
        *([2, 2, 2, 0, 0, 0, 0, 0, 0], [2, 2, 2, 0, 0, 0, 0, 0, 1e308], [2, 2, 2, 0, 0, 0, 0, 0, "1"]),
    ],
)
def test_a_camera_that_cannot_see_the_arm_is_ignored_and_the_rest_is_kept(camera):
    state = there(camera=camera)
    assert state.camera is None
    assert np.array_equal(state.q, PUMA.q_home)


def test_a_camera_is_stored_in_few_digits_without_a_vertical_up_direction():
    camera = np.array([[1.23456789, -2.0, 0.5], [0.0, 1e-9, 0.3], [0.0, 0.0, 1.0]])
    plain, seen = encode(PageState("ur5")), encode(PageState("ur5", camera=camera))
    assert np.array_equal(decode(seen, ROBOTS).camera, [[1.2346, -2.0, 0.5], [0.0, 0.0, 0.3], [0.0, 0.0, 1.0]])
    assert len(seen) - len(plain) < 64


def test_unknown_names_are_ignored():
    view = {"dark": "yes", "axes": False, "x": True, "look": 7}
    state = there(task="dance", branch="elbow sideways", lesson=7, view=view)
    assert (state.task, state.branch, state.lesson) == (None, None, None)
    assert state.view == ViewState(axes=False)
    assert there(task=["pose"], branch={"a": 1}, view=[1], features=[1]).features == {}
    assert there(features={"a": {"n": 1}, "b": 3}).features == {"a": {"n": 1}}
    assert there(branch="seed").branch == "seed"


def test_an_unknown_robot_is_reported_and_its_state_is_ignored():
    state = decode(
        packed({"v": 1, "robot": "somebodys", "q": [0.0] * 5, "task": "approach", "units": "rad"}), ROBOTS
    )
    assert (state.robot, state.missing, state.q, state.task) == (None, "somebodys", None, None)
    assert state.units == Units(degrees=False)
    assert decode(packed({"v": 1, "robot": {"a": [1]}}), ROBOTS).robot is None


def noise(size: int) -> str:
    """A text that cannot be compressed."""
    return random.Random(size).randbytes(size // 2).hex()


def test_features_with_too_much_state_are_left_out_of_the_text_the_longest_first():
    small, large = {"words": "x"}, {"words": noise(2 * MAX_TEXT)}
    written = write(PageState("ur5", features={"small": small, "large": large}))
    assert written.left_out == ("large",)
    assert decode(written.text, ROBOTS).robot == "ur5"
    assert decode(written.text, ROBOTS).features == {"small": small}
    written = write(PageState("ur5", features={"a": {"words": "a" * MOST_BYTES}}))
    assert (written.left_out, decode(written.text, ROBOTS).features) == (("a",), {}), "never more than is read"


@pytest.mark.parametrize("size", [1, LONG // 2, LONG, 10_000, MOST_BYTES - 100])
def test_a_long_state_is_compressed_and_comes_back(size):
    features = {"talker": {"words": "α" + "word " * (size // 5)}}
    text = encode(PageState("ur5", features=features))
    assert re.fullmatch(r"[A-Za-z0-9_-]*", text)
    assert len(text) <= MAX_TEXT
    assert decode(text, ROBOTS).features == features
    assert encode(decode(text, ROBOTS)) == text


def test_states_that_differ_only_in_what_has_no_room_are_not_equal():
    one, other = (PageState("ur5", features={"talker": {"words": word + noise(2 * MAX_TEXT)}}) for word in "ab")
    assert encode(one) == encode(other)
    assert not equal(one, other)
    assert equal(one, replace(one))


@pytest.mark.parametrize("lesson", ["[" * 40 + "]" * 40, "[" + "0," * 20_001 + "0]"])
def test_a_link_beyond_the_limits_is_not_read(lesson):
    packed = zlib.compress(f'{{"v":1,"lesson":{lesson}}}'.encode(), 9)
    assert decode("z" + base64.urlsafe_b64encode(packed).decode().rstrip("="), ROBOTS).unreadable


def bomb(size: int, keep: slice = slice(None), after: bytes = b"") -> str:
    raw = zlib.compress(b'{"v":1,"lesson":"' + b"x" * size + b'"}', 9)
    return "z" + base64.urlsafe_b64encode(raw[keep] + after).rstrip(b"=").decode()


@pytest.mark.parametrize(
    "text",
    [
        *("z", "zzzz", "z" * MAX_TEXT, "zé", "z" + packed({"v": 1, "lesson": "dh"})),
        *(bomb(MOST_BYTES), bomb(8_000_000), bomb(10, slice(-3)), bomb(10, slice(2, None))),
        "z" + base64.urlsafe_b64encode(zlib.compress(b"[" * 60_000)).decode(),
        "z" + base64.urlsafe_b64encode(zlib.compress(b"\xff\xfe")).decode(),
    ],
    ids=range(11),
)
def test_what_is_not_a_compressed_state_restores_nothing(text):
    tracemalloc.start()
    state = decode(text, ROBOTS)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert state.unreadable
    assert peak < 2_000_000, "a link of a few kilobytes must not fill the memory"


def test_a_compressed_state_as_long_as_allowed_is_read():
    text = bomb(MOST_BYTES - len(b'{"v":1,"lesson":""}'))
    assert len(decode(text, ROBOTS).lesson) == MOST_BYTES - len(b'{"v":1,"lesson":""}')
    assert decode(bomb(MOST_BYTES - len(b'{"v":1,"lesson":"')), ROBOTS).unreadable


@pytest.mark.parametrize(
    ("address", "usable"),
    [
        ("http://127.0.0.1:8000/", True),
        ("https://robots.example.org/kin/board/", True),
        ("http://[::1]:8000/", True),
        ("javascript:alert(1)//", False),
        ("http://x/'; rm -rf /; '", False),
        ('http://x/"', False),
        ("http://x/$(id)/", False),
        ("http://" + "x" * 600 + "/", False),
        (5, False),
    ],
)
def test_only_an_http_address_is_accepted_as_the_address_of_the_page(address, usable):
    memory = read_stored_page({"address": address, "state": "abc"})
    assert memory.address == (address if usable else "")
    assert memory.state == "abc"


@pytest.mark.parametrize(
    ("sent", "used"), [("Large", "Large"), ("Tiny", "Normal"), ([], "Normal"), (None, "Normal")]
)
def test_the_page_opens_with_a_known_text_size(sent, used):
    assert read_stored_page({"text": sent}).text_size == used


@pytest.mark.parametrize("remembered", [None, "", [], 5, {}, {"state": 7}])
def test_an_invalid_message_of_the_page_restores_nothing(remembered):
    assert read_stored_page(remembered).state == ""


TEXTS = st.text(st.characters(codec=None), max_size=20)  # half letters too
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**30), 10**30) | st.floats() | TEXTS,
    lambda inner: st.lists(inner, max_size=9) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=12,
)
OWN = {"n": "my <b>", "r": [[0, 100, 50, 90, [-90, 90], "", "one"], [0, 0, 80, 0, [-90, 90], "", "two"]]}


@st.composite
def hostile_states(draw: st.DrawFn) -> str:
    """A link with valid entries, one of which, or a part of one, is replaced by anything."""
    said: dict[str, Any] = {
        "v": 1,
        "robot": draw(st.sampled_from(["own", "puma560", "pioneer5"])),
        "own": copy.deepcopy(OWN),
        "q": [0.0, 0.0],
        "features": {"counter": {"count": 3}},
        "lesson": "dh",
        "task": "pose",
        "length": "cm",
        "obstacles": [["b", "crate", 0.3, 0, 0.2, 0, 0, 0, 0.1, 0.1, 0.1]],
        "frames": ["world", ["w", 0, 0, 0, 0, 0, 0]],
        "view": {},
        "camera": [1, 1, 1, 0, 0, 0],
        "locks": [1],
    }
    place, key = said, draw(st.sampled_from(sorted(said)))
    while isinstance(place[key], dict | list) and place[key] and draw(st.booleans()):
        place = place[key]
        key = draw(st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place))))
    place[key] = draw(ANYTHING)
    return packed(said)


def texts_of(value: object) -> Iterator[str]:
    match value:
        case str():
            yield value
        case dict():
            for key, item in value.items():
                yield from (*texts_of(key), *texts_of(item))
        case list() | tuple():
            for item in value:
                yield from texts_of(item)


@given(hostile_states())
@example(packed({"v": 1, "robot": "\ud800"}))
@example(packed({"v": 1, "robot": "own", "own": {**OWN, "n": "\ud83d"}}))
@example(packed({"v": 1, "features": {"\udfff": {"a": 10**400}}}))
@example(packed({"v": 1, "features": {"a": math.inf}}))
def test_every_text_of_a_state_can_be_sent_to_a_page(text):
    state = decode(text, ROBOTS)
    names = [] if state.own is None else [state.own.start, *vars(state.own.robot).values()]
    shown = [state.robot, state.missing, state.refused, state.ignored, state.features, state.obstacles, names]
    for said in texts_of(shown):
        said.encode()
    encode(state)


# In a session


TALKS = 9  # counts, of a state that is too long for a link


class Counter(Feature):
    key = "counter"
    title = "Counter"

    def __init__(self, stage):
        super().__init__(stage)
        self._slider = stage.client.gui.add_slider("Count", 0, 10, 1, 0)
        listen(self._slider, self.post, "count")

    def handle(self, key, value):
        self._slider.value = value

    def state(self):
        count = self._slider.value
        return {"count": count, **({"talk": noise(2 * MAX_TEXT)} if count == TALKS else {})} if count else {}

    def restore(self, state):
        count = state.get("count")
        if count == 13:
            raise RuntimeError("unlucky")
        if type(count) is int and 0 <= count <= 10:
            self._slider.value = count


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    before, page.TABS = page.TABS, (Counter,)
    with serve_viewer(ViewerServer(STORE, Settings(token="very secret"), Clouds())) as port:
        yield port
    page.TABS = before


def remembering(state: str, address: str = "https://arms.example/kin/") -> str:
    return json.dumps({"address": address, "state": state})


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_a_link_opens_for_visitors_who_may_only_look_what_computes_nothing(lesson: type[Lesson]) -> None:
    text = remembering(encode(PageState("pioneer5", lesson=lesson.key)))
    channel = SimpleNamespace(hello=lambda timeout: json.loads(text))
    for rights, shown in ((Rights.FULL, True), (Rights.LOOK, not lesson.computes)):
        activity = SimpleNamespace(review=SimpleNamespace(zone=""))
        services, links = SimpleNamespace(store=STORE), Links(False, encode_features)
        page_ = SimpleNamespace(channel=channel, services=services, activity=activity, rights=rights, links=links)
        persistence = Persistence(page_, lambda action: action())  # type: ignore[arg-type]
        persistence.load()
        assert persistence.stored.lesson == (lesson.key if shown else None)


def test_some_lessons_are_for_visitors_who_may_only_look() -> None:
    computing = {lesson.key: lesson.computes for lesson in LESSONS}
    assert (computing["dh"], computing["numeric"]) == (False, True)


def kept(tab: FakeBrowser) -> PageState:
    return decode(tab.stored(), ROBOTS)


@pytest.mark.full
def test_a_link_and_a_reconnection_restore_the_view(port):
    q = PUMA.random_q(np.random.default_rng(8))
    far = kin.fk(PUMA, q)
    far[:3, 3] *= 3.0
    view = ViewState(frames=True, dark=True)
    state = PageState("puma560", q, far, "position", "seed", None, RADIANS_CM, view, {"counter": {"count": 4}})
    with FakeBrowser(port, memory=remembering(encode(state))) as tab:
        tab.settle()
        assert (tab.value("Robot"), tab.value("Target must match"), tab.value("Posture")) == (
            PUMA.name,
            "Point only",
            "Keep current",
        )
        assert (tab.value("Radians"), tab.value("Link frames"), tab.value("Page colours"), tab.value("Count")) == (
            True,
            True,
            "Dark",
            4,
        )
        assert np.abs(tab.gizmo_pose() - far).max() < 1e-8
        assert 'data-status="unreachable"' in tab.html
        assert tab.kept == [], "nothing has changed yet"
        tab.set("Count", 5)
        again = kept(tab)
        assert again.features == {"counter": {"count": 5}}
        assert np.abs(again.target - far).max() < 1e-8
        assert (again.view, again.branch, again.units) == (view, "seed", RADIANS_CM)
        q_end, text = again.q, tab.kept[-1]
    with FakeBrowser(port, memory=remembering(text)) as tab:
        tab.settle()
        assert tab.value("Count") == 5
        assert np.abs(np.array([tab.value(label(PUMA, i)) for i in range(PUMA.n)]) - q_end).max() < 6e-4
        assert f"https://arms.example/kin/viewer/#s={text}" in tab.html
        assert "curl -s https://arms.example/kin/api/v1/robots/puma560/fk" in tab.html
        assert "Bearer $KINBOARD_TOKEN" in tab.html
        assert "very secret" not in tab.html


def test_the_first_frame_shows_the_arm_as_in_the_link(port):
    q = PIONEER.random_q(np.random.default_rng(3))
    with FakeBrowser(port, memory=remembering(encode(PageState("pioneer5", q)))) as tab:
        tab.settle()
        assert np.abs(tab.tool_pose() - kin.fk(PIONEER, q)).max() < 1e-8
        assert np.abs(tab.gizmo_pose() - kin.fk(PIONEER, q)).max() < 1e-8
        assert not [m for m in tab.log if m["type"] == "SetOrientationMessage" and "ease" in m]


@pytest.mark.full
def test_the_state_is_stored_after_a_drag_and_not_during_it(port):
    with FakeBrowser(port) as tab:
        tab.settle()
        T = kin.fk(PIONEER, PIONEER.q_home)
        tab.grab()
        for _ in range(30):
            T[2, 3] += 0.0005
            tab.drag(T)
            tab.settle(quiet=0.05)
        tab.settle(quiet=0.8)
        assert tab.kept == []
        tab.release()
        state = kept(tab)
        assert len(tab.kept) == 1
        assert np.abs(kin.fk(PIONEER, state.q)[:3, 3] - T[:3, 3]).max() < 1e-6


def test_acts_without_a_rest_are_stored_within_a_second(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [time.perf_counter()]
    monkeypatch.setattr(page, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    with FakeBrowser(port) as tab:
        tab.settle()
        acts: dict[int, float] = {}  # when each was
        for count in range(1, TALKS):
            now[0] += 0.3
            acts[count] = now[0]
            tab.set("Count", count)
            tab.settle(quiet=0.05)
            stored = decode(tab.kept[-1], ROBOTS).features["counter"]["count"] if tab.kept else 0
            assert all(now[0] - at < 1.0 for count, at in acts.items() if count > stored)
        assert len(tab.kept) <= len(acts) / 2, "not each act alone"


UNREADABLE, PARTLY = (
    "The link cannot be read",
    "Ignored, because it does not fit this robot: joint values, target.",
)


@pytest.mark.parametrize(
    ("memory", "notice"),
    [
        *(("", "Ready"), ("null", "Ready"), ("{}", "Ready")),
        *(('{"state": "AAAA"}', UNREADABLE), (remembering("x" * 20000), UNREADABLE)),
        (remembering(packed({"v": 1, "q": [1e308] * 5, "target": [1], "task": "pose"})), PARTLY),
        (remembering(packed({"v": 1, "lesson": "none such", "features": {"nobody": {"a": 1}}})), "Ready"),
    ],
)
def test_a_hostile_stored_state_gives_a_fresh_page_that_says_so(port, memory, notice):
    with FakeBrowser(port, memory=memory) as tab:
        tab.settle()
        assert tab.value("Robot") == PIONEER.name
        assert np.abs(tab.tool_pose() - kin.fk(PIONEER, PIONEER.q_home)).max() < 1e-9
        assert notice in tab.html


@pytest.mark.full
@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
@given(hostile_states())
@example(packed({"v": 1, "robot": "\ud800"}))
@example(packed({"v": 1, "robot": "a\x00\u202e<script>"}))
@example(packed({"v": 1, "robot": "own", "own": {**OWN, "n": "\ud83d \x00 \u202e </script><svg onload=1>"}}))
def test_a_hostile_state_reaches_its_page(port, caplog, text):
    caplog.clear()
    with FakeBrowser(port, memory=remembering(text)) as tab:
        tab.settle()
        assert tab.value("Robot")
    assert "cannot be sent" not in caplog.text
    assert "Traceback" not in caplog.text


@pytest.mark.full
def test_a_page_that_is_too_long_for_its_address_says_so(port):
    with FakeBrowser(port, memory=remembering(encode(PageState("ur5")))) as tab:
        tab.settle()
        tab.set("Count", TALKS)
        tab.wait(lambda: "has no room for: counter" in tab.html)
        assert "Too long for a link" in tab.html
        assert kept(tab).features == {}
        tab.set("Count", 5)
        assert kept(tab).features == {"counter": {"count": 5}}


def test_a_feature_that_fails_to_restore_does_not_affect_the_rest(port, caplog):
    text = encode(PageState("ur5", features={"counter": {"count": 13}}))
    with FakeBrowser(port, memory=remembering(text)) as tab:
        tab.wait(lambda: "Something went wrong" in tab.html)
        tab.settle()
        assert tab.value("Robot") == "UR5"
    assert "unlucky" in caplog.text


def test_a_missing_robot_is_named(port):
    with FakeBrowser(port, memory=remembering(packed({"v": 1, "robot": "<b>mine</b>"}))) as tab:
        tab.settle()
        assert "This service has no robot “&lt;b&gt;mine&lt;/b&gt;”." in tab.html


def options(tab: FakeBrowser) -> tuple[str, ...]:
    return tuple(tab.gui[tab.element("Locked")]["props"]["options"])


@pytest.mark.full
def test_locked_joints_are_restored_at_their_values(port):
    q = PUMA.random_q(np.random.default_rng(4))
    state = PageState("puma560", q, locks=(1,), features={"counter": {"count": 2}})
    with FakeBrowser(port, memory=remembering(encode(state))) as tab:
        tab.settle()
        assert options(tab) == lock_buttons([False, True, False, False, False, False])
        assert "Ready" in tab.html
        T = kin.fk(PUMA, q)
        T[:3, 3] *= 0.97
        tab.grab()
        tab.drag(T)
        tab.release()
        moved = kept(tab)
        assert moved.locks == (1,)
        assert moved.q[1] == pytest.approx(q[1], abs=1e-9)
        assert np.abs(moved.q - q).max() > 1e-3
        tab.set("Locked", UNLOCK_ALL)
        tab.wait(lambda: len(tab.kept) > 1)
        assert decode(tab.kept[-1], ROBOTS).locks == ()


def test_a_restored_task_has_its_rings(port):
    cobra = STORE.get("scara")
    with FakeBrowser(port, memory=remembering(encode(PageState("scara", cobra.q_home, task="position")))) as tab:
        tab.settle()
        assert tab.value("Target must match") == "Point only"
        assert not [n for n in tab.nodes if n.startswith(f"{tab.gizmo}/ring")]
        assert tab.nodes[tab.gizmo]["props"]["disable_rotations"]


def test_another_language(port):
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Copy as", "MATLAB")
        tab.wait(lambda: "rigidBodyTree" in tab.html)
        tab.set("Copy as", "COBOL")
        tab.wait(lambda: "Invalid input" in tab.html)
        assert tab.value("Copy as") == "MATLAB"


def test_an_arm_in_the_address_is_what_a_page_without_a_state_begins_with() -> None:
    robots = (kin.get_robot("pioneer5"), kin.get_robot("ur5"))
    fresh = read_stored_page({"state": "", "robot": "ur5"})
    assert (opened_with(fresh, robots).robot, opened_with(fresh, robots).missing) == ("ur5", "")
    assert opened_with(read_stored_page({"robot": "ur55"}), robots).missing == "ur55"
    kept = read_stored_page({"state": encode(PageState("pioneer5")), "robot": "ur5"})
    assert opened_with(kept, robots).robot == "pioneer5", "what the visitor has done since"
    assert opened_with(read_stored_page({"robot": 5}), robots).missing == ""
