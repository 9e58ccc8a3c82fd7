"""Debian's PostgreSQL, started for tests and benchmarks on a free port with its data in a temporary folder."""

from __future__ import annotations

import itertools
import os
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import create_engine, text

NOBODY = 65534  # PostgreSQL does not run as root


class Postgres:
    """A server on a free port, with its data in a folder of its own."""

    def __init__(self, programs: Path, folder: Path) -> None:
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self._programs, self._folder = programs, folder
        self._numbers = itertools.count(1)
        self._user = {"user": NOBODY, "group": NOBODY, "extra_groups": []} if os.geteuid() == 0 else {}
        if self._user:
            os.chown(folder, NOBODY, NOBODY)
        self._run("initdb", "-D", folder / "data", "-U", "kinboard", "--auth=trust", "--no-sync", "-E", "UTF8")

    def _run(self, program: str, *arguments: object) -> None:
        command = [str(self._programs / program), *map(str, arguments)]
        with (self._folder / "log").open("a") as log:
            subprocess.run(
                command,
                check=True,
                cwd=self._folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                timeout=60,
                **self._user,
            )

    def start(self) -> None:
        options = f"-p {self.port} -c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c fsync=off"
        self._run(
            "pg_ctl", "-D", self._folder / "data", "-w", "-o", options, "-l", self._folder / "server", "start"
        )

    def stop(self) -> None:
        """As a power failure would: without saying goodbye."""
        self._run("pg_ctl", "-D", self._folder / "data", "-w", "-m", "immediate", "stop")

    def create(self) -> str:
        """The URL of a new database, of another name each time: a test that is run again needs a new one."""
        name = f"kinboard_{next(self._numbers)}"
        url = self.url("postgres").replace("postgresql:", "postgresql+psycopg:")
        engine = create_engine(url, isolation_level="AUTOCOMMIT")
        with engine.connect() as connection:
            connection.execute(text(f"CREATE DATABASE {name}"))
        engine.dispose()
        return self.url(name)

    @property
    def pid(self) -> int:
        """The process of the server; each connection has one below it."""
        return int((self._folder / "data" / "postmaster.pid").read_text().split()[0])

    def url(self, name: str) -> str:
        return f"postgresql://kinboard@127.0.0.1:{self.port}/{name}"


def programs() -> Path:
    """The folder of PostgreSQL's programs: in the PATH, or where Debian has them."""
    found = shutil.which("initdb")
    folders = [Path(found).parent] if found else sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    assert folders, "these tests need PostgreSQL: apt-get install postgresql"
    return folders[-1]


@contextmanager
def running() -> Iterator[Postgres]:
    """A server that runs."""
    with tempfile.TemporaryDirectory(prefix="kinboard-postgres-") as folder:
        server = Postgres(programs(), Path(folder))
        server.start()
        try:
            yield server
        finally:
            server.stop()
