"""`kinboard serve`: settings that do nothing any more, and how many processes compute."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from app.cli import serve
from app.cli.parser import main
from app.shared.settings import OBSOLETE, Settings


def test_settings_and_options_that_do_nothing_any_more_are_accepted_and_say_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    given: list[Settings] = []

    def run(settings: Settings, open_browser: bool) -> int:
        given.append(settings)
        return 0

    monkeypatch.setattr(serve, "import_service", lambda: run)
    for name in OBSOLETE:
        monkeypatch.setenv(name, "2")
    assert main(["serve", "--workers", "3", "--pin", "--port", "0"]) == 0
    said = capsys.readouterr().err.splitlines()
    names = ("KINBOARD_BENCH", "KINBOARD_PIN", "KINBOARD_REST_WORKERS", "KINBOARD_WORKERS")
    assert [line.partition(" does nothing")[0] for line in said] == [
        *(f"kinboard: {name}" for name in (*names, "NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT", "--workers", "--pin"))
    ]
    assert "kinboard bench --html" in said[0]
    assert all("KINBOARD_COMPUTE" in line for line in (*said[2:4], said[6]))
    assert given[0].port == 0


def test_a_command_whose_kernels_cannot_be_loaded_does_not_start_and_says_why(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ImportError("kernels cannot be compiled: there is no clang")

    monkeypatch.setattr("app.service.main.fk", fail)
    assert main(["serve", "--port", "0"]) == 2
    assert capsys.readouterr().err == "kinboard: kernels cannot be compiled: there is no clang\n"
    monkeypatch.setattr("app.cli.workspace.sample_workspace", fail)
    assert main(["workspace", "ur5", "-o", str(tmp_path / "cloud.csv")]) == 2
    assert capsys.readouterr().err == "kinboard: kernels cannot be compiled: there is no clang\n"


@pytest.mark.parametrize(("given", "processes"), [({}, 3), ({"compute": 0}, 0), ({"compute": 5}, 5)])
def test_one_fewer_compute_than_there_are_processors(
    monkeypatch: pytest.MonkeyPatch, given: dict[str, Any], processes: int
) -> None:
    monkeypatch.setattr("app.shared.threads.processors", lambda: 4)
    assert Settings(**given).processes == processes
    assert Settings(**given).on_this_machine().processes == 0
    monkeypatch.setattr("app.shared.threads.processors", lambda: 1)
    assert Settings().processes == 1, "at least one"
