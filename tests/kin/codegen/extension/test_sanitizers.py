"""All entries with sanitizers, and with indices looked at: wrong arguments are refused, or do no harm."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import kin
from kin.codegen import units
from kin.codegen.extension import build

SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


@pytest.mark.full
def test_no_wrong_argument_reaches_any_kernel(tmp_path):
    texts = dict(build.texts(tmp_path, lambda what: None, checked=True))
    texts["module"] = build.module_of(list(texts))

    def compiled(name):
        (tmp_path / f"{name}.c").write_text(texts[name])
        options = ("-std=c11", "-O0", "-w", "-fPIC", "-fvisibility=hidden", *SANITIZED)
        subprocess.run(["gcc", *options, "-c", f"{name}.c"], cwd=tmp_path, check=True)
        return f"{name}.o"

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        objects = list(threads.map(compiled, texts))
    subprocess.run(["gcc", "-shared", *SANITIZED, *objects, "-o", "_kernels.so", "-lm"], cwd=tmp_path, check=True)
    library = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
    environment = {
        **os.environ,
        "LD_PRELOAD": library.stdout.strip(),
        "ASAN_OPTIONS": "detect_leaks=0",  # of Python itself
        "KINBOARD_KERNELS": "python",
        "PYTHONPATH": str(Path(kin.__file__).parents[1]),
    }
    command = [
        sys.executable,
        "-W",
        "error",
        str(Path(__file__).parent / "fuzz.py"),
        str(tmp_path / "_kernels.so"),
    ]
    ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr[-3000:]
    entries = sum(map(len, units.units().values()))
    assert [line.split()[3] for line in ran.stdout.splitlines()] == [str(entries)] * 2
