"""Free memory is given back to the system once the service is idle."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from live_server import wait_for

from app.shared.memory import process as memory
from app.shared.memory.process import BUSY_GROWTH, IDLE_GROWTH, MemoryKeeper, release_free_memory, resident_bytes

ROOT = Path(__file__).parents[3]

# Many small objects between which a few survive, made by a thread: the C library keeps their pages.
FRAGMENTS = """
import threading
from app.shared.memory.process import release_free_memory, resident_bytes

kept = []

def work():
    blocks = [bytes(1000 + k % 7) for k in range(200_000)]
    kept.extend(blocks[::5000])

before = resident_bytes()
thread = threading.Thread(target=work)
thread.start()
thread.join()
between = resident_bytes()
release_free_memory()
print(between - before, resident_bytes() - before)
"""


def test_freed_memory_is_given_back():
    done = subprocess.run(
        [sys.executable, "-c", FRAGMENTS], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    kept, left = map(int, done.stdout.split())
    assert kept > 100e6
    assert left < 0.2 * kept


class Process:
    """Stands for a process that takes `resident` bytes, of which all but `needed` are free."""

    def __init__(self, monkeypatch):
        self.resident = self.needed = 100 << 20
        self.released = self.collected = 0
        monkeypatch.setattr(memory, "resident_bytes", lambda: self.resident)
        monkeypatch.setattr(memory, "release_free_memory", self.release)
        monkeypatch.setattr(memory.gc, "collect", self.collect)

    def release(self):
        self.released += 1
        self.resident = self.needed

    def collect(self):
        self.collected += 1


def test_memory_is_given_back_when_it_has_grown_and_sooner_when_idle(monkeypatch):
    process = Process(monkeypatch)
    idle = True
    keeper = MemoryKeeper(lambda: idle)
    keeper.look()
    keeper.look()
    assert process.released == 1, "nothing has grown since"
    process.resident += IDLE_GROWTH
    idle = False
    keeper.look()
    assert (process.released, process.collected) == (1, 1), "no collection while somebody would notice"
    process.resident += BUSY_GROWTH
    keeper.look()
    assert (process.released, process.collected) == (2, 2), "what has grown much is worth a pause"
    process.resident += IDLE_GROWTH
    idle = True
    keeper.look()
    assert (process.released, process.collected) == (3, 3)


def test_the_thread_looks_until_it_is_stopped(monkeypatch):
    monkeypatch.setattr(memory, "INTERVAL", 0.01)
    looks: list[int] = []
    keeper = MemoryKeeper(lambda: bool(looks.append(1)))
    keeper.start()
    wait_for(lambda: len(looks) > 2)
    keeper.stop()
    keeper._thread.join(10)
    assert not keeper._thread.is_alive()


def test_without_glibc_nothing_happens(monkeypatch):
    memory._malloc_trim.cache_clear()
    monkeypatch.setattr(sys, "platform", "darwin")
    release_free_memory()
    assert memory._malloc_trim() is None
    memory._malloc_trim.cache_clear()
    monkeypatch.setattr(memory, "_PROCESSES", Path("/nowhere"))
    assert resident_bytes() == 0
