"""Classes in real processes that are killed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import httpx2
import pytest
from sqlalchemy import select
from test_hub import ROOT, nothing, until

from app.classroom import COOKIE, Hub
from app.classroom.tables import Attempt

# A student's page that submits answers without end, and prints the id of each that was confirmed.
SUBMITS = """
import sys
from pathlib import Path
from app.classroom import Hub, NewAttempt

hub = Hub(Path(sys.argv[1]))
page = hub.attend(hub.ticket(sys.argv[2]), lambda: None)
page.raise_hand(True)
page.tell_page("mine")
for seed in range(1_000_000):
    print(page.submit(NewAttempt("swing", seed, [seed], "right", 1.0, 0.0)).id, flush=True)
"""


def started(*arguments: object) -> subprocess.Popen[str]:
    """A process with the page of a student."""
    command = [sys.executable, "-c", SUBMITS, *map(str, arguments)]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command, env=env, cwd=ROOT, stdout=subprocess.PIPE, text=True)


@pytest.mark.full
def test_a_killed_process_loses_no_confirmed_answer_and_its_seats_come_back(tmp_path):
    hub = Hub(tmp_path)
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    seat = hub.rooms.join(room.code, "Ada")
    with started(tmp_path, hub.rooms.tokens.sign(seat)) as process:
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


def status(port: int, path: str, cookies: dict[str, str]) -> tuple[int, str]:
    """Over a new connection."""
    answer = httpx2.get(
        f"http://127.0.0.1:{port}{path}",
        headers={"cookie": "; ".join(f"{k}={v}" for k, v in cookies.items())},
        trust_env=False,
        verify=False,
        timeout=20,
    )
    return answer.status_code, answer.text


@contextmanager
def service(data: Path) -> Iterator[int]:
    """The port of a service that is ready; it is killed at the end."""
    command = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
    env = os.environ | {"PYTHONPATH": str(ROOT), "KINBOARD_DATA": str(data)}
    with subprocess.Popen(
        command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            port = int(re.search(r":(\d+)/", process.stdout.readline())[1])
            until(lambda: status(port, "/readyz", {})[0] == 200, seconds=120)
            yield port
        finally:
            os.killpg(process.pid, signal.SIGKILL)


@pytest.mark.slow
def test_sixty_join_in_five_seconds_and_stay_when_the_service_is_killed(tmp_path):
    with service(tmp_path) as port:
        url = f"http://127.0.0.1:{port}"
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
            assert "60 not here yet" in teacher.get("/room").text
    with service(tmp_path) as port:
        for _, cookies in joined:
            code_, text = status(port, "/room", cookies)
            assert code_ == 200
            assert "You are in this room as a student" in text
