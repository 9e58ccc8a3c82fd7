"""Parts of a class that need no page: cells of the wall, sharing, submissions, acts."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.classroom import ClassroomUnavailable, Confirmed, NewAttempt, RefusedError, RoomView, SeatView, Task
from app.viewer.exercises.feature import Practising
from app.viewer.room import submissions, views
from app.viewer.room.member import act_of
from app.viewer.room.sharing import REST, Sharing
from app.viewer.room.student import Student
from app.viewer.room.submissions import Submissions
from app.viewer.room.wall import MOST, cells, columns_of
from app.viewer.scene.camera import DIRECTION
from app.viewer.session.state import PageState
from app.viewer.worksheet.feature import Worksheets

ATTEMPT = NewAttempt("swing", 1, [1], "Yes.", 1.0, 0.0)


@given(st.integers(1, MOST), st.floats(0.4, 2.5), st.floats(0.1, 10.0))
def test_cells_are_apart_and_face_the_default_view(count: int, aspect: float, pitch: float) -> None:
    columns = columns_of(count, aspect)
    assert 1 <= columns <= count
    found = cells(count, columns, pitch, np.array([1.0, 2.0, 3.0]))
    assert found.shape == (count, 3)
    np.testing.assert_allclose((found - [1.0, 2.0, 3.0]) @ DIRECTION, 0.0, atol=1e-9 * (1 + pitch * count))
    apart = np.linalg.norm(found[:, None] - found[None], axis=2) + 1e9 * np.eye(count)
    assert apart.min() >= pitch * (1 - 1e-9)


def test_a_state_is_sent_at_most_so_often_and_only_if_it_changed() -> None:
    sent: list[str] = []
    states = [PageState(robot="a")]
    sharing = Sharing(lambda: states[0], sent.append, lambda: 0.2)
    assert sharing.tick(1.0) == 0.2
    states[0] = PageState(robot="b")
    assert sharing.tick(1.1) == pytest.approx(0.1), "too soon"
    assert len(sent) == 1
    assert sharing.tick(1.2) == 0.2
    assert len(sent) == 2
    assert sharing.tick(1.5) == REST, "once more, for what is reported late"
    assert sharing.tick(1.9) is None
    assert len(sent) == 2


@pytest.mark.parametrize(
    ("error", "stored"), [(ClassroomUnavailable("locked."), 1), (RefusedError("removed."), 0)]
)
def test_an_answer_is_stored_or_it_is_said_why_not(
    monkeypatch: pytest.MonkeyPatch, error: Exception, stored: int
) -> None:
    monkeypatch.setattr(submissions, "AGAIN", 0.01)
    errors, changed, problems = [error], threading.Event(), []

    def submit(attempt: NewAttempt) -> Confirmed:
        if errors:
            raise errors.pop()
        return Confirmed(attempt.id, 1.0)

    def note() -> None:
        problems.append(sent.problem)
        if not sent.waiting:
            changed.set()

    sent = Submissions(submit, note)
    sent.add(ATTEMPT)
    assert changed.wait(10.0)
    assert problems[0] == str(error)
    assert (sent.stored, sent.waiting) == (stored, 0)
    changed.clear()
    sent.add(ATTEMPT)
    assert changed.wait(10.0)
    assert (sent.stored, sent.problem) == (stored + 1, "")


@pytest.mark.parametrize(
    ("key", "value", "act"),
    [
        ("home", None, "home"),
        (("joint", "pioneer5", 0), 3.0, "joint"),
        (("message", "nudge", 7), None, "nudge"),
        (("message", "feature", 7), ["exercises", ["answer", 1], 0], "feature"),
        (("message", "feature", 7), ["class", ["hand", 1], None], ""),
        (("message", "feature", 7), ["sheet", ["page", 1], None], ""),
        (("message", "feature", 7), [], ""),
        (("message", "unknown", 7), None, ""),
        (("feature", "workspace", "chunk"), None, ""),
        (("view", "labels"), True, ""),
        ("looked", None, ""),
    ],
)
def test_acts_are_what_a_visitor_does_to_the_arm(key: object, value: object, act: str) -> None:
    assert act_of(key, value, (Practising, Student, Worksheets)) == act  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("seat", "state"),
    [
        (SeatView("1", "A", away=True, hand=3.0), "away"),
        (SeatView("1", "A", hand=3.0, task="swing", solved=True), "hand"),
        (SeatView("1", "A", task="swing", solved=True, tries=1), "solved"),
        (SeatView("1", "A", task="swing", tries=3), "stuck"),
        (SeatView("1", "A", task="other", tries=3), "working"),
    ],
)
def test_how_a_student_is_doing(seat: SeatView, state: str) -> None:
    assert views.doing(seat, RoomView("r", task=Task("swing", 1.0))) == state
