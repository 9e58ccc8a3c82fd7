"""Classes over several real processes, one of which is killed."""

from __future__ import annotations

import os
import re
import signal
import statistics
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx2
import pytest
from sqlalchemy import select
from test_hub import ROOT, nothing, until

from app.classroom import COOKIE, Hub
from app.classroom.tables import Attempt

CLASSES = Path(__file__).with_name("classes.py")


def started(*arguments: object) -> subprocess.Popen[str]:
    """A process of `classes.py`."""
    command = [sys.executable, str(CLASSES), *map(str, arguments)]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command, env=env, cwd=ROOT, stdout=subprocess.PIPE, text=True)


@pytest.mark.full
def test_a_killed_process_loses_no_confirmed_answer_and_its_seats_come_back(tmp_path):
    hub = Hub(tmp_path)
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    seat = hub.rooms.join(room.code, "Ada")
    with started("submits", tmp_path, hub.rooms.tokens.sign(seat)) as process:
        confirmed = [process.stdout.readline().strip() for _ in range(30)]
        until(
            lambda: teacher.room.seats and teacher.room.seats[0].page == "mine" and teacher.room.seats[0].hand > 0
        )
        process.send_signal(signal.SIGKILL)
        confirmed += process.stdout.read().split()
    with hub.database.read() as connection:
        assert set(confirmed) <= set(connection.scalars(select(Attempt.id)))
    again = hub.attend(seat, nothing)
    assert again.room.seat.alias == "Ada"
    assert again.room.seat.page == "mine"
    assert again.room.seat.hand > 0
    until(lambda: not again.room.problem)
    hub.close()


def drag(folder: object, processes: int, students: int = 30, moves: int = 100) -> list[float]:
    """Milliseconds from the teacher's drag at 20 Hz to each student's page, in other processes."""
    hub = Hub(Path("/nonexistent"), folder) if isinstance(folder, str) else Hub(folder)
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    teacher.set_follow(True)
    tokens = [hub.rooms.tokens.sign(hub.rooms.join(room.code, f"Student {k}")) for k in range(students)]
    classes = [started("follows", folder, *tokens[k::processes]) for k in range(processes)]
    for process in classes:
        assert process.stdout.readline() == "ready\n"
    at = {}
    for k in range(moves):
        name = f"{k}-" + "x" * 800  # as long as the state of a page
        at[name] = time.monotonic_ns()
        teacher.tell_page(name)
        time.sleep(0.05)
    time.sleep(0.3)
    teacher.tell_page("end")
    late = []
    for process in classes:
        with process:
            for line in process.stdout:
                name, *times = line.split()
                late += [(int(each) - at[name]) / 1e6 for each in times if name in at]
    teacher.end_room()
    hub.close()
    return sorted(late)


@pytest.mark.slow
@pytest.mark.parametrize("processes", [1, 2])
def test_a_drag_reaches_thirty_students_of_other_processes_in_time(tmp_path, processes):
    late = drag(tmp_path, processes)
    p50, p95 = statistics.median(late), late[int(0.95 * len(late))]
    print(
        f"{processes} processes: {len(late)} pictures, p50 {p50:.0f} ms, p95 {p95:.0f} ms, most {late[-1]:.0f} ms"
    )
    assert len(late) > 30 * 60  # newer ones replace those that are on their way
    assert p95 <= 150


def status(port: int, path: str, cookies: dict[str, str]) -> tuple[int, str]:
    """Over a new connection, so that either process may answer."""
    answer = httpx2.get(
        f"http://127.0.0.1:{port}{path}",
        headers={"cookie": "; ".join(f"{k}={v}" for k, v in cookies.items())},
        trust_env=False,
        verify=False,
        timeout=20,
    )
    return answer.status_code, answer.text


@pytest.mark.slow
def test_sixty_join_in_five_seconds_and_stay_when_processes_are_killed(tmp_path):
    command = [sys.executable, "-m", "app.cli", "serve", "--workers", "2", "--port", "0"]
    env = os.environ | {"PYTHONPATH": str(ROOT), "KINBOARD_DATA": str(tmp_path)}
    with subprocess.Popen(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True) as service:
        try:
            port = int(re.search(r":(\d+)/", service.stdout.readline())[1])
            url = f"http://127.0.0.1:{port}"
            until(lambda: status(port, "/readyz", {})[0] == 200, seconds=120)
            with httpx2.Client(base_url=url, trust_env=False, verify=False, timeout=20) as teacher:
                assert teacher.post("/room", data={"title": "Storm", "hours": "2"}).status_code == 303
                page = teacher.get("/room").text
                code = re.search(r'class="code">([^<]+)<', page).group(1)

                def join(k: int) -> tuple[float, dict[str, str]]:
                    time.sleep(5.0 * k / 60)
                    begin = time.monotonic()
                    answer = httpx2.post(
                        f"{url}/room/join",
                        data={"code": code, "alias": f"Student {k}"},
                        trust_env=False,
                        verify=False,
                        timeout=20,
                    )
                    assert answer.status_code == 303
                    return time.monotonic() - begin, dict(answer.cookies)

                with ThreadPoolExecutor(60) as pool:
                    joined = list(pool.map(join, range(60)))
                times = sorted(seconds for seconds, _ in joined)
                print(f"joined: p50 {times[30] * 1000:.0f} ms, p95 {times[57] * 1000:.0f} ms")
                assert len({cookies[COOKIE] for _, cookies in joined}) == 60
                assert "60 students" in teacher.get("/room").text
            children = Path(f"/proc/{service.pid}/task/{service.pid}/children").read_text().split()
            assert len(children) >= 4
            for child in children:
                os.kill(int(child), signal.SIGKILL)
            until(lambda: answers(port), seconds=60)
            for _, cookies in joined:
                code_, text = status(port, "/room", cookies)
                assert code_ == 200
                assert "You are in this room as a student" in text
        finally:
            service.terminate()
            service.wait(20)


def answers(port: int) -> bool:
    """Whether the service accepts connections again."""
    try:
        return status(port, "/readyz", {})[0] == 200
    except httpx2.HTTPError:
        return False
