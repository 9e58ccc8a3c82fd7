"""LTI 1.3 against a platform double that signs, checks signatures, and is asked over real HTTP."""

from __future__ import annotations

import html
import json
import re
import time
from collections.abc import Iterator
from urllib.parse import parse_qs, urlsplit

import jwt
import pytest
from fastapi.testclient import TestClient
from live_server import wait_for
from lti_platform import CLIENT, MEMBER, TOOL, Platform, launch, login, new_key, registered
from pydantic import SecretStr
from stored_bytes import stored_bytes

from app.classroom import COOKIE, Hub, NewAttempt, clock
from app.classroom.courses import Courses, course_of
from app.classroom.lti import passback as passback_module
from app.classroom.lti.exchange import PlatformError
from app.classroom.lti.launches import CLAIM, LINK, LINKING
from app.classroom.lti.platforms import PlatformFileError, key_file, load_platforms, make_key
from app.classroom.lti.services import post_score
from app.cli.parser import main
from app.exercises import Exercises
from app.service.main import create_app, run
from app.service.web.lti import STATE_COOKIE
from app.shared.settings import Settings


@pytest.fixture(scope="module")
def platform() -> Iterator[Platform]:
    with Platform() as double:
        yield double


@pytest.fixture(scope="module")
def settings(platform: Platform, tmp_path_factory) -> Settings:
    return registered(tmp_path_factory.mktemp("lti"), platform)


@pytest.fixture(scope="module")
def application(settings: Settings):
    application = create_app(settings)
    yield application
    hub_of(application).close()


def hub_of(application) -> Hub:
    hub = application.state.classroom
    assert isinstance(hub, Hub)
    return hub


@pytest.fixture
def browser(application) -> TestClient:
    return TestClient(application, base_url=TOOL, follow_redirects=False)


def test_our_keys_are_public(browser: TestClient) -> None:
    (key,) = browser.get("/lti/keys").json()["keys"]
    assert set(key) == {"kty", "n", "e", "kid", "alg", "use"}, "nothing private"


def test_a_login_asks_the_platform(browser: TestClient, platform: Platform) -> None:
    answer = browser.post("/lti/login", data={"iss": platform.issuer, "login_hint": "7", "lti_message_hint": "m"})
    asked = parse_qs(urlsplit(answer.headers["location"]).query)
    assert asked["redirect_uri"] == [f"{TOOL}/lti/launch"]
    assert (asked["response_mode"], asked["prompt"], asked["lti_message_hint"]) == (["form_post"], ["none"], ["m"])
    cookie = answer.headers["set-cookie"]
    assert all(part in cookie for part in ("HttpOnly", "Secure", "SameSite=none", "Partitioned"))
    unknown = browser.get("/lti/login", params={"iss": "https://evil.example", "login_hint": "7"})
    assert unknown.status_code == 400
    assert "is not registered here" in unknown.text


def test_a_student_gets_a_seat(browser: TestClient, platform: Platform, application) -> None:
    answer = launch(browser, platform)
    assert (answer.status_code, answer.headers["location"]) == (303, "../viewer/")
    hub = hub_of(application)
    ticket = hub.ticket(browser.cookies[COOKIE])
    assert ticket.seat
    attendance = hub.attend(ticket, lambda: None)
    assert attendance.room.title == "Week 3"
    assert attendance.room.task.exercise == "two-elbows"
    attendance.leave()
    launch(browser, platform)
    assert hub.ticket(browser.cookies[COOKIE]) == ticket, "the same seat again"
    other = TestClient(application, base_url=TOOL, follow_redirects=False)
    launch(other, platform, sub="user-8")
    seat = hub.ticket(other.cookies[COOKIE])
    assert (seat.room, seat.seat != ticket.seat) == (ticket.room, True)
    stored = stored_bytes(hub.folder)
    assert b"Ada" in stored
    assert b"Lovelace" not in stored
    assert b"ada@school" not in stored


def test_a_launch_opens_the_viewer_of_a_service_with_an_access_token(platform: Platform, settings) -> None:
    guarded = create_app(settings.model_copy(update={"token": SecretStr("a-long-enough-token")}))
    browser = TestClient(guarded, base_url=TOOL, follow_redirects=False)
    assert browser.get("/viewer/").status_code == 401
    assert launch(browser, platform, sub="user-10").status_code == 303
    assert STATE_COOKIE not in browser.cookies
    assert browser.get("/viewer/").status_code == 503, "admitted; the viewer is not started in this test"
    assert browser.get("/api/v1/robots").status_code == 401
    hub_of(guarded).close()


def test_a_teacher_gets_the_room(browser: TestClient, platform: Platform, application) -> None:
    launch(browser, platform, **{CLAIM + "roles": [f"{MEMBER}#Instructor"]})
    ticket = hub_of(application).ticket(browser.cookies[COOKIE])
    assert not ticket.seat


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"key": new_key()}, "signature of the launch is not the platform"),
        ({"exp": int(time.time()) - 300}, "has expired"),
        ({"aud": "another tool"}, "client id is not ours"),
        ({"aud": [CLIENT, "other"], "azp": "other"}, "authorized party is not us"),
        ({"iss": "https://evil.example"}, "of another platform than its login"),
        ({"nonce": "guessed"}, "nonce of the launch is not the one of its login"),
        ({"nonce": None}, "nonce"),
        ({"sub": None}, "sub"),
        ({CLAIM + "deployment_id": "3"}, "deployment &#x27;3&#x27; of the platform is not registered"),
        ({CLAIM + "version": "1.1"}, "not of LTI version 1.3.0"),
        ({CLAIM + "message_type": "Other"}, "are not understood"),
        ({CLAIM + "resource_link": None}, "claim/resource_link.id of the launch is missing"),
    ],
)
def test_a_wrong_launch_is_refused_in_words(browser: TestClient, platform: Platform, changes, words) -> None:
    asked = login(browser, platform)
    nonce = changes.get("nonce", asked["nonce"])
    rest = {name: value for name, value in changes.items() if name != "nonce"}
    token = platform.token(nonce, **rest)
    answer = browser.post("/lti/launch", data={"id_token": token, "state": asked["state"]})
    assert answer.status_code == 403
    assert words in answer.text
    assert COOKIE not in browser.cookies


def test_an_unsigned_token_is_refused(browser: TestClient, platform: Platform) -> None:
    asked = login(browser, platform)
    claims = jwt.decode(platform.token(asked["nonce"]), options={"verify_signature": False})
    for forged in (
        jwt.encode(claims, None, "none", {"kid": "p1"}),
        jwt.encode(claims, "x" * 64, "HS256", {"kid": "p1"}),
        "",
        "a.b.c",
    ):
        answer = browser.post("/lti/launch", data={"id_token": forged, "state": asked["state"]})
        assert answer.status_code == 403
        assert COOKIE not in browser.cookies


def test_a_launch_counts_once(browser: TestClient, platform: Platform) -> None:
    asked = login(browser, platform)
    cookie = browser.cookies[STATE_COOKIE]
    sent = {"id_token": platform.token(asked["nonce"]), "state": asked["state"]}
    assert browser.post("/lti/launch", data=sent).status_code == 303
    browser.cookies.set(STATE_COOKIE, cookie)
    again = browser.post("/lti/launch", data=sent)
    assert again.status_code == 403
    assert "was used before" in again.text


@pytest.mark.parametrize(
    ("passed", "ahead", "back", "words"),
    [
        (0.0, 3600.0, 0.0, "was used before"),
        (0.0, 3600.0, -3600.0, "was used before"),
        (700.0, 700.0, 0.0, "took too long"),
    ],
)
def test_a_clock_that_is_set_lets_no_launch_be_replayed(
    browser: TestClient, platform: Platform, application, monkeypatch, passed, ahead, back, words
) -> None:
    """`passed` seconds after a launch, by a clock that is `ahead`, another is made; then the clock is set back."""

    def launched(client: TestClient) -> tuple[str, dict[str, str]]:
        asked = login(client, platform)
        cookie = client.cookies[STATE_COOKIE]
        token = platform.token(asked["nonce"], iat=began, exp=began + 9000)
        sent = {"id_token": token, "state": asked["state"]}
        assert client.post("/lti/launch", data=sent).status_code == 303
        return cookie, sent

    wall, steady, began = time.time, clock.steady, int(time.time())
    clock.now()  # as a service does when it starts
    cookie, sent = launched(browser)
    monkeypatch.setattr(clock, "steady", lambda: steady() + passed)
    monkeypatch.setattr(time, "time", lambda: wall() + ahead)
    launched(TestClient(application, base_url=TOOL, follow_redirects=False))  # forgets what is over
    monkeypatch.setattr(time, "time", lambda: wall() + back)
    browser.cookies.set(STATE_COOKIE, cookie)
    again = browser.post("/lti/launch", data=sent)
    assert again.status_code == 403
    assert words in again.text


def test_a_launch_belongs_to_the_browser_of_its_login(
    browser: TestClient, platform: Platform, application
) -> None:
    asked = login(browser, platform)
    victim = TestClient(application, base_url=TOOL, follow_redirects=False)
    sent = {"id_token": platform.token(asked["nonce"]), "state": asked["state"]}
    assert "cookie is missing" in victim.post("/lti/launch", data=sent).text
    victim.cookies.set(STATE_COOKIE, "forged")
    answer = victim.post("/lti/launch", data={**sent, "state": "forged"})
    assert "is not one of ours" in answer.text


def test_a_score_goes_back(browser: TestClient, platform: Platform, application, monkeypatch) -> None:
    monkeypatch.setattr(passback_module, "PAUSES", (0.0, 0.0))
    launch(browser, platform, sub="user-9")
    hub = hub_of(application)
    attendance = hub.attend(hub.ticket(browser.cookies[COOKIE]), lambda: None)
    platform.scores.clear()
    for score, exercise in ((0.5, "two-elbows"), (0.25, "two-elbows"), (1.0, "swing")):
        attendance.submit(NewAttempt(exercise=exercise, seed=1, answer={}, verdict="", score=score, started=0.0))
        wait_for(lambda: bool(platform.scores))
    attendance.leave()
    path, sent = platform.scores[-1]
    assert path == "/columns/5/scores?type=x"
    assert (sent["userId"], sent["scoreGiven"], sent["scoreMaximum"]) == ("user-9", 0.5, 1)
    assert "comment" not in sent


def test_a_course_opens_in_the_room_and_its_score_is_the_share_that_is_solved(
    browser: TestClient, platform: Platform, application, monkeypatch
) -> None:
    monkeypatch.setattr(passback_module, "PAUSES", (0.0, 0.0))
    course = Courses(Exercises()).named["first-steps"]
    link = {CLAIM + "custom": {"course": "first-steps"}, CLAIM + "resource_link": {"id": "link-2"}}
    assert launch(browser, platform, sub="user-11", **link).status_code == 303
    hub = hub_of(application)
    attendance = hub.attend(hub.ticket(browser.cookies[COOKIE]), lambda: None)
    assert attendance.room.task is None
    assert attendance.room.course_at > 0
    assert course_of(json.loads(attendance.room.course), Exercises()) == course
    first, second, *rest = course.exercises
    outside = next(one.id for one in Exercises().all if one.id not in course.exercises)
    expected = []
    for exercise, score, solved in (
        *((outside, 1.0, None), (first, 0.5, 0), (first, 1.0, 1), (first, 1.0, 1), (first, 0.0, 1)),
        *((outside, 1.0, 1), (second, 1.0, 2), *((each, 1.0, 3 + i) for i, each in enumerate(rest))),
    ):
        platform.scores.clear()
        attendance.submit(NewAttempt(exercise=exercise, seed=1, answer={}, verdict="", score=score, started=0.0))
        if solved is None:
            continue
        wait_for(lambda: bool(platform.scores))
        path, sent = platform.scores[-1]
        assert path == "/columns/5/scores?type=x"
        expected.append(solved)
        assert (sent["userId"], sent["scoreGiven"], sent["scoreMaximum"]) == (
            "user-11",
            solved,
            len(course.exercises),
        )
        done = solved == len(course.exercises)
        assert sent["activityProgress"] == ("Completed" if done else "InProgress")
        assert sent["gradingProgress"] == "FullyGraded"
    assert expected[-1] == len(course.exercises)
    attendance.leave()


@pytest.mark.parametrize(
    ("custom", "words"),
    [
        ({"course": "first-step"}, "names the course &#x27;first-step&#x27;, which this service does not have"),
        ({"course": "first-step"}, "course may be, for example, first-steps"),
        ({"exercise": "<b>"}, "names the exercise &#x27;&lt;b&gt;&#x27;, which this service does not have"),
        ({"exercise": "swing", "course": "first-steps"}, "it may have one of them"),
    ],
)
def test_a_link_to_what_is_not_there_is_refused_in_words(browser, platform: Platform, custom, words) -> None:
    answer = launch(browser, platform, **{CLAIM + "custom": custom})
    assert answer.status_code == 403
    assert words in answer.text
    assert COOKIE not in browser.cookies


def test_a_score_and_its_token_go_to_no_other_address(browser: TestClient, platform: Platform, settings) -> None:
    """A column that answers with a redirect gets no second request: it would carry the access token."""
    platforms = load_platforms(settings.lti)
    (registered,) = platforms.all
    for status in (301, 302, 303, 307, 308):
        platform.redirects = status
        with pytest.raises(PlatformError, match=f"answered {status}: redirects are not followed") as refused:
            post_score(platforms, registered, f"{platform.issuer}/moved", "user-9", 1.0)
        assert refused.value.final
    assert platform.followed == []


@pytest.mark.parametrize(
    "published", ["<html>Login</html>", "[]", '"x"', "{}", '{"keys": 5}', '{"keys": [{"kty": "RSA"}]}', ""]
)
def test_keys_that_are_none_are_said(platform: Platform, settings, published: str) -> None:
    platform.published = published
    application = create_app(settings)
    try:
        answer = launch(TestClient(application, base_url=TOOL, follow_redirects=False), platform)
    finally:
        platform.published = None
        hub_of(application).close()
    assert answer.status_code == 503
    assert int(answer.headers["retry-after"]) > 0
    assert "is not a set of public keys" in answer.text


def test_deep_linking(browser: TestClient, platform: Platform) -> None:
    settings = {"deep_link_return_url": f"{platform.issuer}/back", "data": "opaque", "accept_multiple": True}
    page = launch(browser, platform, **{CLAIM + "message_type": LINK, LINKING: settings})
    assert page.status_code == 200
    about = html.unescape(re.search('name="about" value="([^"]*)"', page.text)[1])
    for name in ("exercise:two-elbows", "course:first-steps"):
        assert f'type="checkbox" name="content" value="{name}"' in page.text
    course = Courses(Exercises()).named["first-steps"]
    assert f"{course.title} <small>{len(course.exercises)} exercises</small>" in page.text
    chosen = ["exercise:two-elbows", "course:first-steps", "exercise:swing", "exercise:no-such"]
    form = {"about": about, "content": chosen}
    done = browser.post("/lti/choose", data=form)
    assert f"form-action {platform.issuer}" in done.headers["content-security-policy"]
    assert f'action="{platform.issuer}/back"' in done.text
    token = html.unescape(re.search('name="JWT" value="([^"]*)"', done.text)[1])
    key = jwt.PyJWKSet.from_dict(browser.get("/lti/keys").json()).keys[0].key
    claims = jwt.decode(token, key, ["RS256"], audience=platform.issuer, issuer=CLIENT)
    base = "https://purl.imsglobal.org/spec/lti-dl/claim/"
    assert claims[base + "data"] == "opaque"
    items = claims[base + "content_items"]
    assert [item["custom"] for item in items] == [
        {"exercise": "two-elbows"},
        {"course": "first-steps"},
        {"exercise": "swing"},
    ]
    columns = [(item["lineItem"]["scoreMaximum"], item["lineItem"]["resourceId"]) for item in items]
    assert columns == [(1, "two-elbows"), (len(course.exercises), "course:first-steps"), (1, "swing")]
    assert items[0]["url"] == f"{TOOL}/lti/launch"
    forged = browser.post("/lti/choose", data={**form, "about": about[:-2] + "xx"})
    assert forged.status_code == 403


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("issuer = 5", "issuer: got 5; it must be a text"),
        ("deployments = []", "deployments: got []; it must be a list"),
        (
            'keys_url = "http://school.example/keys"',
            "keys_url: got 'http://school.example/keys'; it must be an address",
        ),
        ('colour = "red"', "colour: the fields are"),
    ],
)
def test_a_wrong_file_is_refused_in_words(tmp_path, line: str, words: str) -> None:
    rows = {
        "issuer": '"https://a.example"',
        "client_id": '"c"',
        "deployments": '["1"]',
        **dict.fromkeys(("login_url", "token_url", "keys_url"), '"https://a.example/x"'),
    }
    name, _, value = line.partition(" = ")
    file = tmp_path / "platforms.toml"
    file.write_text("[[platform]]\n" + "\n".join(f"{k} = {v}" for k, v in {**rows, name: value}.items()))
    with pytest.raises(PlatformFileError, match=re.escape(words)):
        load_platforms(file)


def test_the_key_is_made_once_and_is_secret(tmp_path) -> None:
    file = tmp_path / "platforms.toml"
    file.write_text("")
    with pytest.raises(PlatformFileError, match="there is no private key"):
        load_platforms(file)
    key = key_file(file, {})
    assert make_key(key)
    assert key.stat().st_mode & 0o077 == 0
    before = key.read_bytes()
    assert not make_key(key)
    assert key.read_bytes() == before
    assert load_platforms(file).all == ()


def test_the_service_does_not_start_with_a_wrong_file(tmp_path, capsys) -> None:
    file = tmp_path / "platforms.toml"
    file.write_text("colour = 1")
    assert run(Settings(port=0, lti=file)) == 1  # type: ignore[arg-type]
    assert f"kinboard: KINBOARD_LTI: {file}: colour" in capsys.readouterr().err


def test_the_command_prints_what_to_enter(tmp_path, platform: Platform, capsys) -> None:
    assert main(["lti", "--url", "https://kin.example/arm"]) == 0
    shown = capsys.readouterr().out
    for path in ("login", "launch", "keys"):
        assert f"https://kin.example/arm/lti/{path}" in shown
    example = shown[shown.index("[[platform]]") :]
    file = tmp_path / "platforms.toml"
    file.write_text(example)
    assert main(["lti", str(file)]) == 0, "the example is a valid file"
    shown = capsys.readouterr().out
    assert "A private key was written to" in shown
    assert "Moodle of the school: https://moodle.school.example" in shown
    file.write_text(example.replace("https://moodle.school.example/mod/lti/token.php", "ftp://x"))
    assert main(["lti", str(file)]) == 2
    assert "token_url: got 'ftp://x'" in capsys.readouterr().err
