"""The pages of classrooms: what they admit, refuse and remember."""

from __future__ import annotations

import asyncio
import ipaddress
import re
import threading
from collections import Counter

import httpx2
import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect
from stored_bytes import stored_bytes

from app.classroom import COOKIE, ClassroomUnavailable, RefusedError, clock
from app.classroom.tokens import CODE_LENGTH, LETTERS
from app.service.main import create_app
from app.service.web.rooms import guests, limits, network
from app.shared.settings import Settings
from app.shared.store import Store

STORE = Store()
TOKEN = "a-long-enough-token"


@pytest.fixture
def make(tmp_path):
    """Makes browsers of one service; each keeps its own cookies."""
    apps = []

    def browser(**settings):
        if not apps:
            apps.append(create_app(Settings(data=tmp_path / "data", **settings), STORE))
        return TestClient(apps[0], follow_redirects=False, base_url="http://school.example")

    yield browser
    for app in apps:
        app.state.classroom.close()


def open_room(teacher, **form):
    """Open a room; returns its code."""
    answer = teacher.post("/room", data={"title": "Kinematics 1", "hours": "2", **form})
    assert answer.status_code == 303, answer.text
    return re.search(r'class="code">([^<]+)<', teacher.get("/room").text).group(1)


def teacher_link(teacher):
    """The path of the teacher's link."""
    return re.search(r"http://school\.example(/room/teach/[^\"<]+)", teacher.get("/room").text).group(1)


def join(student, code, alias="Ada"):
    return student.post("/room/join", data={"code": code, "alias": alias})


@pytest.mark.parametrize("hours", ["５", "٣", "1_0", "two", "nan"])
def test_hours_are_a_number_in_ascii_digits(make, hours):
    answer = make().post("/room", data={"title": "Kinematics 1", "hours": hours})
    assert answer.status_code == 422
    assert "is not a number of hours" in answer.text


def test_looking_at_the_pages_makes_no_file_and_no_thread(make, tmp_path):
    before = threading.active_count()
    assert "Open a room" in make().get("/room").text
    assert make().get("/room", params={"code": "ABC"}).status_code == 200
    assert make().get("/room/qr.svg").status_code == 404
    assert list(tmp_path.iterdir()) == []
    assert not any(thread.name == "kinboard-classroom" for thread in threading.enumerate())
    assert threading.active_count() <= before + 1  # the test client's own


def test_a_class_joins_by_code_and_ends(make, tmp_path):
    teacher, student = make(), make()
    code = open_room(teacher)
    assert "your answers with times, and how many were right in <i>Review</i>" in student.get("/room").text
    answer = join(student, code.lower().replace("-", " "))
    assert (answer.status_code, answer.headers["location"]) == (303, "../viewer/")
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    assert "Secure" not in cookie
    page = student.get("/room").text
    assert "You are in this room as a student" in page
    assert "teach/" not in page
    assert "0 students so far, 1 not here yet." in teacher.get("/room").text
    assert teacher.get("/room/qr.svg").headers["content-type"] == "image/svg+xml"
    assert student.post("/room/end").status_code == 403
    assert "has ended" in teacher.post("/room/end").text
    assert "has ended" in student.get("/room").text
    assert COOKIE not in student.cookies
    assert join(make(), code).status_code == 404
    assert student.get("/room/qr.svg").status_code == 404
    stored = stored_bytes(tmp_path / "data")
    assert b"SQLite format 3" in stored
    assert b"Ada" not in stored
    assert b"Kinematics" not in stored


@pytest.mark.parametrize(
    ("host", "here", "opened", "words", "missing"),
    [
        ("0.0.0.0", "192.168.1.20", "localhost:8000", 'href="http://192.168.1.20:8000/', "Ctrl-C"),
        ("0.0.0.0", None, "localhost:8000", "name or address in the network", "--host"),
        ("127.0.0.1", "192.168.1.20", "127.0.0.1:8000", "--host 0.0.0.0", "192.168"),
        ("0.0.0.0", "192.168.1.20", "school.example", "Open a room", "Only this machine"),
    ],
)
def test_a_teacher_at_an_address_that_students_cannot_open_reads_where_to_go(
    tmp_path, monkeypatch, host, here, opened, words, missing
):
    monkeypatch.setattr(network, "address_here", lambda: here)
    app = create_app(Settings(data=tmp_path / "data", host=host), STORE)
    teacher = TestClient(app, follow_redirects=False, base_url=f"http://{opened}")
    before = teacher.get("/room").text
    teacher.post("/room", data={"title": "Kinematics 1", "hours": "2"})
    after = teacher.get("/room").text
    app.state.classroom.close()
    for page in (before, after.replace("Start teaching", "Open a room")):
        assert words in page
        assert missing not in page
    if "href" in words:
        assert f"{words}room#open" in before
        token = re.search(r"/room/teach/([^\"<]+)", after).group(1)
        assert f"{words}room/teach/{token}" in after


def test_a_data_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    for data, rooms, said in (("file/data", 9, "read-only"), ("new/data", 9, "ready"), ("new/data", 0, "off")):
        app = create_app(Settings(data=tmp_path / data, max_rooms=rooms), STORE)
        teacher = TestClient(app, follow_redirects=False, base_url="http://school.example")
        assert teacher.get("/readyz").json()["classrooms"] == said
        answer = teacher.post("/room", data={"title": "Kinematics 1", "hours": "2"})
        app.state.classroom.close()
        assert answer.status_code == {"read-only": 503, "ready": 303, "off": 422}[said]
        assert ("cannot be written" in answer.text) == (said == "read-only")


def test_the_address_here_is_none_in_a_container_or_without_a_network(tmp_path, monkeypatch):
    monkeypatch.setattr(network, "CONTAINERS", ())
    found = network.address_here()
    assert found is None or not ipaddress.ip_address(found).is_loopback
    monkeypatch.setattr(network, "_OUTSIDE", ("127.0.0.1", 9))
    assert network.address_here() is None
    monkeypatch.setattr(network, "_OUTSIDE", ("192.0.2.1", 9))
    monkeypatch.setattr(network, "CONTAINERS", (tmp_path,))
    assert network.address_here() is None


def test_the_teachers_link_teaches_on_another_device(make):
    teacher, tablet, thief = make(), make(), make()
    open_room(teacher)
    link = teacher_link(teacher)
    answer = tablet.get(link)
    assert (answer.status_code, answer.headers["location"]) == (303, "../../viewer/")
    assert "You are the teacher of this room" in tablet.get("/room").text
    for forged in (
        link[:-2] + ("A" if link[-2] != "A" else "B") + link[-1],  # the last letter has unused bits
        link[:30],
        "/room/teach/x",
        "/room/teach/" + "y" * 5000,
    ):
        answer = thief.get(forged)
        assert answer.status_code == 404
        assert "set-cookie" not in answer.headers


def test_a_students_token_is_no_teachers_link(make):
    teacher, student = make(), make()
    join(student, open_room(teacher))
    assert student.get(f"/room/teach/{student.cookies[COOKIE]}").status_code == 404


def test_joining_again_keeps_the_seat(make):
    teacher, student = make(), make()
    code = open_room(teacher)
    join(student, code, "Ada")
    first = student.cookies[COOKIE]
    join(student, code, "Ada L.")
    assert student.cookies[COOKIE] == first
    join(make(), code, "Ada")
    assert "0 students so far, 2 not here yet." in teacher.get("/room").text


def test_who_gets_a_number_to_the_alias_reads_so_and_the_rule_stands_before_the_error(make):
    code = open_room(make())
    assert "1 to 32 characters" in make().get("/room").text
    assert join(make(), code, "Bob").status_code == 303, "straight to the arm"
    second = make()
    answer = join(second, code, "Bob")
    assert answer.status_code == 200
    assert "Another student has this alias: you are “Bob 2” here." in answer.text
    assert "Open my arm" in answer.text
    assert "You are in this room as a student" in second.get("/room").text


@pytest.mark.parametrize(
    ("alias", "words"),
    [("", "empty"), ("   ", "empty"), ("\u202e\u200b", "empty"), ("x" * 33, "33 characters")],
)
def test_invalid_aliases_are_named(make, alias, words):
    code = open_room(make())
    answer = join(make(), code, alias)
    assert answer.status_code == 422
    assert words in answer.text
    assert code in answer.text  # what was typed stays


def test_aliases_and_titles_are_escaped(make):
    teacher, student = make(), make()
    code = open_room(teacher, title="<script>alert(1)</script>")
    assert "<script>alert" not in teacher.get("/room").text
    answer = join(student, "<b>no", "<img src=x onerror=alert(1)>")
    assert answer.status_code == 404
    assert "<img src=x" not in answer.text
    assert "<b>no" not in answer.text
    assert join(student, code, "<img src=x>").status_code == 303


def test_forms_of_other_sites_are_refused(make):
    teacher = make()
    code = open_room(teacher)
    foreign = {"origin": "https://evil.example"}
    for path in ("/room", "/room/join", "/room/leave", "/room/end"):
        answer = teacher.post(path, data={"code": code, "alias": "x"}, headers=foreign)
        assert answer.status_code == 403, path
    assert teacher.post("/room/end", headers={"origin": "http://school.example"}).status_code == 200


def test_guessing_codes_is_slow_and_does_not_keep_a_class_out(make, monkeypatch):
    monkeypatch.setattr(limits, "SLOW", 0.05)
    monkeypatch.setattr(limits, "WRONG", 5)
    teacher = make()
    code = open_room(teacher)
    statuses = [join(make(), "AAAA-AAA").status_code for _ in range(8)]
    assert statuses == [404] * 5 + [429] * 3
    assert join(make(), code).status_code == 303


def join_at_once(app, code, count):
    """The statuses of so many students of one address who join at the same time."""

    async def run():
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://school.example") as client:
            forms = [{"code": code, "alias": f"Ada {k}"} for k in range(count)]
            return await asyncio.gather(*(client.post("/room/join", data=form) for form in forms))

    return Counter(answer.status_code for answer in asyncio.run(run()))


def test_codes_that_are_tried_at_once_are_limited_like_one_after_the_other(make, monkeypatch):
    monkeypatch.setattr(limits, "SLOW", 0.05)
    monkeypatch.setattr(limits, "WRONG", 5)
    teacher = make()
    code = open_room(teacher)
    hub, looked = teacher.app.state.classroom, []
    find = hub.join
    monkeypatch.setattr(hub, "join", lambda *given: looked.append(given) or find(*given))
    assert join_at_once(teacher.app, code, 10) == {303: 10}, "right codes neither count nor pause"
    looked.clear()
    assert join_at_once(teacher.app, "AAAA-AAA", 100) == {404: limits.WRONG, 429: 100 - limits.WRONG}
    assert len(looked) == limits.WRONG + limits.SLOW_AT_ONCE


def test_one_address_cannot_take_all_rooms(make):
    browser = make(max_rooms=8)
    for _ in range(6):  # three quarters
        open_room(browser)
    answer = browser.post("/room", data={"hours": "2"})
    assert answer.status_code == 422
    assert "6 rooms were opened from your address" in answer.text
    hub = browser.app.state.classroom
    assert hub.rooms.open("of another", 3600.0, "192.0.2.7")
    assert hub.rooms.open("of the operator", 3600.0)
    with pytest.raises(RefusedError, match="as many rooms as it may"):
        hub.rooms.open("one too many", 3600.0, "192.0.2.8")


def test_rooms_cannot_be_opened_without_end(make):
    browser = make(max_rooms=2)
    open_room(browser)
    open_room(browser)
    answer = browser.post("/room", data={"hours": "2"})
    assert answer.status_code == 422
    assert "as many rooms" in answer.text
    many = make()
    statuses = [many.post("/room", data={"hours": "2"}).status_code for _ in range(limits.ROOMS)]
    assert statuses[-1] == 429


@pytest.mark.parametrize("hours", ["x", "-1", "nan", "inf", "1e9"])
def test_a_life_must_be_a_sensible_number(make, hours):
    assert make().post("/room", data={"title": "", "hours": hours}).status_code == 422


def test_with_a_token_students_join_but_do_not_open_rooms(make):
    teacher, student, stranger = make(token=TOKEN), make(), make()
    teacher.headers["authorization"] = f"Bearer {TOKEN}"
    code = open_room(teacher)
    assert "sign in" in student.get("/room", headers={"accept": "text/html"}).text
    assert student.post("/room", data={"hours": "2"}).status_code == 401
    assert student.get("/viewer/").status_code == 401
    assert join(student, code).status_code == 303
    assert student.get("/viewer/").status_code == 503  # admitted: the viewer has not been started here
    for path in ("/api/v1/robots", "/metrics", "/docs"):
        assert student.get(path).status_code == 401, path
    assert student.post("/room", data={"hours": "2"}).status_code == 401
    assert stranger.get("/viewer/").status_code == 401
    guest = student.cookies["kinboard_guest"]
    for path in ("/viewer", "/viewer/channel"):
        options = {"subprotocols": ["kinboard-1", "name"]}
        headers = {"cookie": f"kinboard_guest={guest}"}
        with make().websocket_connect(path, **options, headers=headers) as line:
            assert line.receive()["code"] == 1013, "admitted too"
        with pytest.raises(WebSocketDisconnect) as refused, stranger.websocket_connect(path, **options):
            pass
        assert refused.value.code == 1008
    for cookie, status in ((guest, 503), (guest.replace(".", "x.", 1), 401), ("x.y", 401)):
        headers = {"cookie": f"kinboard_guest={cookie}"}
        assert make().get("/viewer/", headers=headers).status_code == status


@pytest.mark.parametrize("how", ["removed", "ended", "over"])
def test_a_guest_loses_the_viewer_with_the_seat(make, monkeypatch, how):
    teacher, student, other = make(token=TOKEN), make(), make()
    teacher.headers["authorization"] = f"Bearer {TOKEN}"
    code = open_room(teacher)
    for each in (student, other):
        join(each, code)
    hub = student.app.state.classroom
    ticket = hub.ticket(student.cookies[COOKIE])
    assert student.get("/viewer/").status_code == 503
    asked = []
    find = hub.rooms.is_open
    monkeypatch.setattr(hub.rooms, "is_open", lambda each: asked.append(each) or find(each))
    if how == "removed":
        hub.rooms.remove_seat(ticket.room, ticket.seat)
    elif how == "ended":
        hub.rooms.end(ticket.room)
    else:
        began = clock.now()
        monkeypatch.setattr("app.classroom.rooms.now", lambda: began + 7300.0)
    assert student.get("/viewer/").status_code == 503, "asked a moment ago"
    assert asked == []
    monkeypatch.setattr(guests, "FRESH", 0.0)
    assert student.get("/viewer/").status_code == 401
    assert len(asked) == 1
    assert other.get("/viewer/").status_code == (503 if how == "removed" else 401)


def test_guests_are_admitted_while_the_database_is_away(make, monkeypatch):
    teacher, student = make(token=TOKEN), make()
    teacher.headers["authorization"] = f"Bearer {TOKEN}"
    join(student, open_room(teacher))
    rooms = student.app.state.classroom.rooms

    def away(_):
        raise ClassroomUnavailable("locked")

    monkeypatch.setattr(rooms, "is_open", away)
    assert student.get("/viewer/").status_code == 503
    assert make().get("/viewer/").status_code == 401


def test_codes_cannot_be_guessed_in_the_life_of_a_room():
    """The figures of docs/security.md: as fast as the limits let one address."""
    per_second = limits.SLOW_AT_ONCE / limits.SLOW
    codes = len(LETTERS) ** CODE_LENGTH
    day = limits.WRONG_ALL + 24 * 3600 * per_second
    assert day / codes < 1e-5  # chance to find a certain room
    assert codes / per_second / (365 * 24 * 3600) > 300  # years to try all
