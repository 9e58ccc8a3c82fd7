"""Shells complete commands, options, their values and robots. Each is asked itself, where it is installed."""

from __future__ import annotations

import os
import pty
import select
import subprocess
import time
from pathlib import Path

import pytest

from app.cli import parser

CASES = [
    (["wor"], {"workspace"}),
    (["fk", "pio"], {"pioneer5"}),
    (["fk", "ur5", "--form"], {"--form", "--format"}),
    (["fk", "ur5", "--format", ""], {"csv", "npy", "ndjson"}),
    (["ik", "--redun"], {"--redundancy"}),
    (["workspace", "--strategy", "u"], {"uniform"}),
    (["open", "pio"], {"pioneer5"}),
    (["room", "o"], {"open"}),
    (["room", "open", "--ho"], {"--hours"}),
    (["completion", ""], {"bash", "zsh", "fish"}),
    (["compare", "panda", "stan"], {"stanford"}),
    (["check", "pyproj"], {"pyproject.toml"}),
    (["fk", "ur5", "-o", "pyproj"], {"pyproject.toml"}),
    (["serve", "--robots", "exam"], {"examples"}),
]


@pytest.fixture
def script(capsys, tmp_path):
    """The file of the script for a shell."""

    def write(name):
        assert parser.main(["completion", name]) == 0
        file = tmp_path / f"kinboard.{name}"
        file.write_text(capsys.readouterr().out)
        return file

    return write


@pytest.mark.parametrize(("words", "expected"), CASES)
def test_bash_completes(script, words, expected):
    asked = f"""
        source {script("bash")}
        COMP_WORDS=(kinboard {" ".join(word or "''" for word in words)}); COMP_CWORD={len(words)}
        _shtab_kinboard; printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(["bash", "-uc", asked], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == expected


@pytest.mark.parametrize(("words", "expected"), CASES)
def test_fish_completes(script, words, expected):
    line = " ".join(["kinboard", *words])
    asked = f"source {script('fish')}; complete -C '{line}'"
    done = subprocess.run(["fish", "--no-config", "-c", asked], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    found = {each.split("\t")[0].rstrip("/") for each in done.stdout.splitlines()}
    assert {each for each in found if each in expected or not Path(each).exists()} == expected


@pytest.mark.full
@pytest.mark.parametrize(("words", "expected"), CASES)
def test_zsh_completes(script, words, expected):
    """Typed at a terminal: zsh completes only there. A list is shown where there are several."""
    file = script("zsh")
    child, terminal = pty.fork()
    if child == 0:
        os.execvpe("zsh", ["zsh", "-f", "-i"], {"PATH": os.environ["PATH"], "TERM": "dumb", "PS1": "> "})
    try:

        def type_and_read(text, until):
            os.write(terminal, text.encode())
            shown, end = "", time.monotonic() + 20
            while not all(each in shown for each in until):
                assert time.monotonic() < end, shown
                if select.select([terminal], [], [], 0.1)[0]:
                    shown += os.read(terminal, 4096).decode(errors="replace")
            return shown

        setup = f'autoload -U compinit; compinit -u -D; eval "$(cat {file})"; unsetopt list_beep; setopt auto_list'
        type_and_read(setup + "; echo rea''dy\n", ["ready"])
        type_and_read(" ".join(["kinboard", *words]) + "\t\t", expected)
    finally:
        os.kill(child, 9)
        os.waitpid(child, 0)
        os.close(terminal)
