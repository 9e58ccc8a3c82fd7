"""The load tools against a real service, in small: what they count, and that visitors leave nothing behind."""

from __future__ import annotations

import asyncio
import time
from math import cos, isnan, sin
from multiprocessing.connection import Connection

import pytest
from load import attackers, attacks, cloud, drag, lesson, play, rest, siege, soak, storm
from load.raw import Socket
from load.service import Usage
from load.visitor import STEP, SWING, Visitor

pytestmark = pytest.mark.full


@pytest.fixture(scope="module")
def served():
    with lesson.served() as running:
        yield running


@pytest.fixture
def service(served):
    return served[0]


def test_each_request_is_answered_and_counted(service):
    rows = asyncio.run(rest.measure(service, 2, 0.1, 2, ["fk", "ik"]))
    assert [row["request"] for row in rows] == [rest.EMPTY, "fk", "ik"]
    assert all(row["per second"] > 0 and 0 < row["p50 ms"] <= row["p99 ms"] for row in rows)
    assert rows[0]["% of empty"] == 100


def test_every_drag_is_answered_by_its_own_picture(service):
    row = asyncio.run(drag.measure(service, 2, 2.0))
    assert row["unanswered"] == 0
    assert row["events"] >= 60
    assert 0 < row["p50 ms"] <= row["p95 ms"] <= row["p99 ms"]


def test_a_picture_on_the_way_to_an_earlier_target_answers_nothing():
    visitor = Visitor()
    visitor._home = [1.0, 0.0, 0.0, 0.0]
    visitor._position, visitor._wxyz = [1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
    visitor.gizmo = {"name": "/arm-1-target", "owner": ""}
    visitor.send = lambda *_, **__: None

    def shown(angle):
        visitor._shown([float(x) for x in (cos(angle / 2), 0, 0, sin(angle / 2))], 1e9)

    for _ in range(2):
        assert visitor.drag()
    shown(0.5 * STEP)  # half-way to the first
    assert (len(visitor.latencies), visitor.unanswered) == (1, 1)
    shown(STEP)  # at the first, exactly
    assert visitor.unanswered == 1
    shown(1.3 * STEP)
    assert (len(visitor.latencies), visitor.unanswered) == (2, 0)
    for _ in range(round(SWING / STEP) - 2):
        assert visitor.drag()
    assert not visitor.drag(), "the hand waits at the turning point"
    shown(SWING)
    assert visitor.unanswered == 0
    assert visitor.drag()
    shown(SWING)
    assert visitor.unanswered == 1
    shown(SWING - 0.5 * STEP)
    assert visitor.unanswered == 0


def test_a_picture_that_has_passed_the_turning_point_unseen_answers_what_it_can():
    """A student's page shows the newest state of the teacher's: it may turn back before the end of the swing."""
    teacher, student = Visitor(), Visitor()
    teacher._home = [1.0, 0.0, 0.0, 0.0]
    teacher._position, teacher._wxyz = [1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
    teacher.gizmo = {"name": "/arm-1-target", "owner": ""}
    teacher.send = lambda *_, **__: None

    def both(events):
        for _ in range(events):
            assert teacher.drag()
            student.watch(teacher)

    def shown(visitor, steps):
        visitor._shown([float(x) for x in (cos(steps * STEP / 2), 0, 0, sin(steps * STEP / 2))], 1e9)

    turn = round(SWING / STEP)
    both(turn)
    shown(teacher, turn)
    shown(student, turn - 1)
    assert (teacher.unanswered, student.unanswered) == (0, 1)
    both(4)
    shown(student, turn - 2.5)  # back already: on the way to the third of the four
    assert student.unanswered == 1
    shown(student, turn - 2.6)
    assert student.unanswered == 1
    shown(student, turn - 3.5)
    assert student.unanswered == 0
    both(1)
    shown(student, turn - 3.4)  # cannot be: it has been farther
    assert student.unanswered == 1


def test_all_who_come_at_once_get_their_page(service):
    row = asyncio.run(storm.measure(service, 6))
    assert row["failed"] == 0
    assert 0 < row["arm p50 s"] <= row["all pages s"]


def test_a_lesson_measures_its_pictures_and_its_wall(served, monkeypatch):
    monkeypatch.setattr(lesson, "UP", 0.5)
    row = asyncio.run(lesson.follow(*served, 2, 1.5))
    assert row["unanswered"] == 0
    assert 0 < row["drags"] <= round(1.5 * drag.HZ)  # the hand waits for a slow service at its turning points
    assert row["pictures"] == 2 * row["drags"]
    assert 0 < row["p50 ms"] <= row["p95 ms"] < 1e3 * lesson.PATIENCE
    rows = {row["students"]: row for row in asyncio.run(lesson.wall(*served, 2, 1.0))}
    assert set(rows) == {"no room", "in a room", "on the wall", "the wall alone"}
    assert rows["on the wall"]["kB/s to the teacher"] > 2 * rows["in a room"]["kB/s to the teacher"]


def test_students_who_come_together_all_get_a_seat_and_a_page(served):
    row = asyncio.run(lesson.join(*served, 4, 0.5))
    assert (row["lost"], row["why"]) == (0, "")
    assert 0 < row["seat p95 ms"] < row["arm p95 ms"] <= 1e3 * row["all pages s"]


def test_every_point_arrives_by_every_way(service):
    rows = asyncio.run(cloud._of_size(service, 20_000, 1))
    assert [row["way"] for row in rows][1:] == ["REST, bin", "REST, websocket", "viewer"]


def test_the_steps_of_a_point_are_reported_next_to_numpy_and_the_floors():
    rows = {row["alone"]: row for row in cloud.alone(quick=True)}
    shares = [row["% of the steps"] for row in rows.values() if not isnan(row["% of the steps"])]
    assert len(shares) == 4
    assert sum(shares) == pytest.approx(100.0)
    assert rows["kinboard, kernel"]["× kernel"] == 1.0
    assert {"kinboard, generator", "numpy", "floor: sine, cosine", "floor: points written"} <= set(rows)


def test_a_message_of_numbers_that_looks_like_text_is_heard_too():
    async def heard():
        found = []
        socket = Socket(b"", found.append)
        socket._upgraded = True
        for opcode, data in ((2, b"{\x01\x02\x03"), (1, b'{"type": "progress"}'), (2, b"plain")):
            socket.data_received(bytes([0x80 | opcode, len(data)]) + data)
        return found

    assert asyncio.run(heard()) == [b"{\x01\x02\x03", b'{"type": "progress"}', b"plain"]


def test_visitors_leave_nothing_behind(service):
    before, after = asyncio.run(soak.soak(service, 3, 2, 0.5))
    assert soak.left_behind(before, after, 6) == []


def test_a_steady_load_is_weighed_each_minute(service):
    rows, early, end = asyncio.run(soak.steady(service, 2, minute=4.0))
    assert [row["minute"] for row in rows] == [1, 2]
    assert all(0 < row["requests"] <= 6 and row["drags"] > 0 for row in rows)  # fewer than four on a busy machine
    assert not any(row["lost"] for row in rows)
    assert end.seconds > early.seconds > 0.0


def test_a_siege_counts_what_visitors_and_attackers_met(service, monkeypatch):
    monkeypatch.setattr(siege, "VISITORS", 2)
    under = siege.Siege(service, niceness=0)
    asyncio.run(under.run(1, 3.0, 0.1, 0.5))
    assert [phase.name for phase in under.phases] == ["quiet", "attacked", "quiet"]
    assert all(phase.drags and phase.peak for phase in under.phases)
    assert any(phase.requests for phase in under.phases)  # on a busy machine, half a second is too short for one
    assert [row["attack"] for row in under.attacks] == [attack.name for attack in attackers.ATTACKS]
    assert any(row["MB sent"] > 0 for row in under.attacks)  # on a busy machine, some attackers begin late
    statuses = asyncio.run(siege.answers(service))
    assert statuses["200"] > 0
    report = siege.report(under, statuses | {"500": 1}, 0, 0)
    assert "1 answers 5xx" in report["left behind"]
    assert not any("lost" in wrong for wrong in report["left behind"])


def test_programs_of_pages_attack(service, monkeypatch):
    monkeypatch.setattr(attackers, "FLOOD", 2.0)
    rounds = {attack.name: attack.round for attack in attackers.ATTACKS}
    guessing, flooding = (attackers.Attacker(service.port, "", f"127.0.1.{k}") for k in (1, 2))
    asyncio.run(rounds["codes of pages"](guessing))
    assert guessing.statuses["101"] == 10
    asyncio.run(rounds["programs of pages"](flooding))
    assert flooding.sent > 2e6, "messages of 1 MB were sent, and taken"


def late(port: int, token: str, seconds: float, report: Connection, *_: object) -> None:
    """Attackers who get few turns."""
    report.send(None)
    time.sleep(2.0)
    report.send((seconds, [{"attack": "none"}]))


def test_visitors_are_served_while_attackers_are_late(service, monkeypatch):
    """Visitors who read nothing meanwhile would be disconnected, and count as lost."""
    monkeypatch.setattr(siege, "attack", late)
    turns = 0

    async def besieged() -> list[dict[str, object]]:
        async def turn() -> None:
            nonlocal turns
            while True:
                await asyncio.sleep(0.01)
                turns += 1

        async with siege.Siege(service).attack(0.0) as found:
            turning = asyncio.create_task(turn())
        turning.cancel()
        return found

    assert asyncio.run(besieged()) == [{"attack": "none"}]
    assert turns > 5


def ended(*_: object) -> None:
    """Attackers who end without a word."""


def test_attackers_who_say_nothing_end_the_siege(service, monkeypatch):
    monkeypatch.setattr(siege, "attack", ended)

    async def besieged() -> None:
        async with siege.Siege(service).attack(0.0):
            pass

    with pytest.raises(RuntimeError, match="the attackers ended"):
        asyncio.run(besieged())


def test_each_attack_is_measured_alone(service, monkeypatch):
    monkeypatch.setattr(siege, "VISITORS", 2)
    monkeypatch.setattr(attacks, "BEGINNING", 0.1)
    (row,) = asyncio.run(attacks.measure(siege.Siege(service, niceness=0), [["no HTTP"]], 1.0, 0.5))
    assert row["attack"] == "no HTTP"
    assert row["p95 ms"] > 0 < row["loop CPU %"] <= row["CPU %"]


@pytest.mark.parametrize(
    ("more", "word"), [((0, 0, 1, 0), "1 threads"), ((0, 0, 0, 2), "2 file handles"), ((0, 1 << 28, 0, 0), "kB")]
)
def test_leaks_are_reported(more, word):
    before = Usage(1.0, 1 << 28, 10, 20)
    after = Usage(*(a + b for a, b in zip((1.0, 1 << 28, 10, 20), more, strict=True)))
    for visits in (100, 0):
        (message,) = soak.left_behind(before, after, visits)
        assert (word if visits or word != "kB" else "268 MB") in message


@pytest.mark.slow
def test_programs_are_played_evenly(service):
    row = asyncio.run(play.measure(service, 2, 2.0))
    assert row["pictures/s each"] > 5
    assert 0 < row["gap p50 ms"] <= row["gap p95 ms"]
