"""Translate, compile and link the extension, unit by unit.

A unit is what Python calls of one folder of the core; what several units need is compiled into each. Objects are
kept by the hash of their text and command, so that a change compiles one unit again and links.

The compiler is clang, of the package ``ziglang`` or the machine's: gcc fuses multiplications and additions that it
was asked not to, and its loops are slower. With ``ziglang`` any machine builds for all others.

``python -m kin.codegen.extension.build FOLDER`` builds for this machine. With ``--checked`` an index outside its
axis, which reads or writes the memory of something else, is an `IndexError` that names the line. A file in `kin`
is used instead of one built for the checkout.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import math
import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib import metadata
from pathlib import Path

from kin.codegen import units
from kin.codegen.extension import wrappers
from kin.codegen.fingerprint import file_of, fingerprint
from kin.codegen.source import OutsideSubsetError
from kin.kernels.ahead import key_of, levels

HERE = Path(__file__).parent
# Rounding is that of the kernels. Without `-fno-math-errno` loops that take square roots are not vectorised.
FLAGS = (
    *("-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-sanitize=undefined"),
    *("-fvisibility=hidden", "-w"),
)
# Without it loops are up to 1.4 times slower than for the processor at hand. As `-mtune`, ziglang would take it
# for the processor itself, and use instructions that others do not have. The machine's own clang, which before
# version 16 does not know `-tune-cpu`, builds for this machine alone: it gets `-mtune=native`.
_TUNED = ("-Xclang", "-tune-cpu", "-Xclang", "znver4")
LEVELS: Mapping[str, tuple[str, ...]] = {
    "x86_64_v2": ("-march=x86_64_v2",),
    "x86_64_v3": ("-march=x86_64_v3", *_TUNED),
    "x86_64_v4": ("-march=x86_64_v4", *_TUNED, "-mprefer-vector-width=512"),
    "aarch64": (),
}
LINUX, MACOS, WINDOWS = "linux-gnu.2.17", "macos.11.0", "windows-gnu"
# Without `-nostdlib` zig compiles its own library for four seconds, of which nothing is used.
_LINKED: Mapping[str, tuple[str, ...]] = {
    LINUX: ("-nostdlib", "-lm", "-lc"),
    MACOS: ("-Wl,-undefined,dynamic_lookup",),
    WINDOWS: (),
}
UNUSED = 30 * 86400.0  # s: what is kept and was not used for so long is removed
SILENT = 10.0  # s without a line in a log
# What is kept, by its place in the folder, where there may be other files: texts, objects, extensions, and what
# `kin.kernels.ahead` notes of them.
_HASH = "[0-9a-f]{32}"
_OWN = re.compile(
    rf"texts/{_HASH}\.c|objects/{_HASH}\.o|{_HASH}/_kernels_\w+\.(abi3\.so|pyd)|{_HASH}-\w+\.txt(\.\d+)?"
)
Say = Callable[[str], object]


class BuildError(Exception):
    """The extension cannot be built; says why."""


def file_name(level: str, system: str) -> str:
    """The file of the extension for a level of processors and a system."""
    return f"_kernels_{level}.{'pyd' if system == WINDOWS else 'abi3.so'}"


def own_system() -> str:
    """The system of this machine."""
    return {"darwin": MACOS, "win32": WINDOWS}.get(sys.platform, LINUX)


def compiler() -> tuple[list[str], str]:
    """The command of clang, and its version.

    Raises:
        BuildError: there is none.
    """
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-P", "-m", "ziglang", "cc"], f"ziglang {metadata.version('ziglang')}"
    if found := shutil.which("clang"):
        return [found], subprocess.run([found, "--version"], capture_output=True, text=True, check=True).stdout
    raise BuildError("kernels cannot be compiled: there is no clang; pip install ziglang, which brings one")


def options_for(level: str, system: str, zig: bool) -> list[str]:
    """Options of the compiler for a level of processors and a system."""
    options = [*FLAGS, *LEVELS[level], *(() if system == WINDOWS else ("-fPIC",))]
    if zig:
        return [f"--target={level.partition('_v')[0]}-{system}", *options]
    if system != own_system() or level not in levels():
        raise BuildError("kernels for another machine need the package ziglang: pip install ziglang")
    own = [each.replace("x86_64_v", "x86-64-v") for each in options if each not in _TUNED]
    return own if len(own) == len(options) else [*own, "-mtune=native"]


def texts(folder: Path, say: Say, checked: bool = False) -> Iterator[tuple[str, str]]:
    """The names of all units and their C, kept in a folder for as long as nothing changes that it depends on.

    checked: see `wrappers.unit`.
    """
    own = [fingerprint(wrappers.__file__), *(file.read_text("utf-8") for file in sorted(HERE.parent.rglob("*.h")))]
    for name, lines in units.units().items():
        modules = {each.rpartition(".")[0] for line in lines for each in re.findall(r"kin[\w.]+", line)}
        depends = [fingerprint(file) for each in sorted(modules) if (file := file_of(each))]

        def make(beside: Path, name: str = name, lines: list[str] = lines) -> None:
            say(f"translating {name}")
            beside.write_text(wrappers.unit(name, map(units.entry_of, lines), checked), "utf-8")

        yield name, _kept(folder / f"{key_of(own, depends, lines, checked)}.c", make).read_text("utf-8")


def build(made: Iterable[tuple[str, str]], folder: Path, level: str, system: str, say: Say) -> Path:
    """Compile units, and link them.

    Args:
        made: their names and texts.
        folder: where objects and extensions are kept.

    Returns:
        The extension, in a folder of its own.

    Raises:
        BuildError: there is no compiler, or it fails.
    """
    clang, version = compiler()
    options, names = options_for(level, system, "ziglang" in clang), list[str]()

    def compiled(name: str, text: str) -> str:
        def make(beside: Path) -> None:
            say(f"compiling {name} for {level}")
            source = beside.with_suffix(".c")
            source.write_text(text, "utf-8")
            _run([*clang, *options, "-c", str(source), "-o", str(beside)])

        return str(_kept(folder / "objects" / f"{key_of(version, options, text)}.o", make))

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        running = []
        for name, text in made:
            names.append(name)
            running.append(threads.submit(compiled, name, text))
        module = module_of(names)
        running.append(threads.submit(compiled, "module", module))
        objects = [each.result() for each in running]
    library = folder / key_of(objects, system) / file_name(level, system)
    more = [*_LINKED[system], *(_imports(folder, module, level) if system == WINDOWS else ())]
    return _kept(library, lambda to: _run([*clang, *options, "-shared", "-s", *objects, *more, "-o", str(to)]))


def module_of(names: Iterable[str]) -> str:
    """The text of the module, with the units that it has."""
    declared = "".join(f"extern const kinboard_unit kinboard_unit_{name};\n" for name in names)
    table = f"static const kinboard_unit *const units[] = {{{', '.join(f'&kinboard_unit_{n}' for n in names)}}};\n"
    module = (HERE / "module.c").read_text("utf-8").replace('#include "units.h"', declared + table, 1)
    return module.replace('#include "unit.h"', wrappers.HEADER, 1)


def imports_of(module: str) -> list[str]:
    """What the module takes from ``python3.dll``, as its declarations say: lines of a definition file."""
    declared = " ".join(re.findall(r"^API ([^;]*);", module, re.MULTILINE))
    names = dict(re.findall(r"\b(_?Py\w*_\w+)(\()?", declared))
    return [
        f"{name}{'' if call else ' DATA'}"
        for name, call in names.items()
        if name not in ("Py_ssize_t", "Py_buffer")
    ]


def _imports(folder: Path, module: str, level: str) -> list[str]:
    """For Windows: a library of what the module imports, without Python's own."""
    machine = "arm64" if level.startswith("aarch64") else "i386:x86-64"
    file, made = folder / "python3.def", folder / f"python3-{level}.lib"
    file.write_text("\n".join(["LIBRARY python3.dll", "EXPORTS", *imports_of(module), ""]), "utf-8")
    _run([sys.executable, "-P", "-m", "ziglang", "dlltool", "-m", machine, "-d", str(file), "-l", str(made)])
    return [str(made)]


def _run(command: list[str]) -> None:
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode:
        raise BuildError(f"kernels cannot be compiled: {' '.join(command)}\n{ran.stderr[-2000:]}")


def _kept(file: Path, make: Callable[[Path], object]) -> Path:
    """A file, made unless it is there: beside its place, as other processes may look for it meanwhile."""
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent) as beside:
            made = Path(beside) / file.name
            make(made)
            made.replace(file)
    os.utime(file)
    return file


def prune(folder: Path) -> None:
    """Remove what is kept in a folder and was not used for `UNUSED` seconds."""
    for file in (*folder.glob("*.*"), *folder.glob("*/*.*")):
        if _OWN.fullmatch(file.relative_to(folder).as_posix()):
            with contextlib.suppress(OSError):  # another process has removed it, or has it open
                about = file.lstat()
                if stat.S_ISREG(about.st_mode) and time.time() - about.st_mtime > UNUSED:
                    file.unlink()


def main() -> int:
    """Build, and print where the extension is, or why there is none."""
    parser = argparse.ArgumentParser(prog="python -m kin.codegen.extension.build", description=__doc__)
    parser.add_argument("folder", type=Path, help="where it is put, with what is needed to build it again quickly")
    parser.add_argument("--level", choices=LEVELS, default=next(levels()), help="processors (default: this one)")
    parser.add_argument("--system", choices=_LINKED, default=own_system(), help="(default: this one)")
    parser.add_argument("--checked", action="store_true", help="an index outside its axis is an IndexError; slow")
    given = parser.parse_args()
    started, terminal, said = time.monotonic(), sys.stderr.isatty(), -math.inf

    def say(what: str) -> None:
        nonlocal said
        now = time.monotonic()
        if terminal or now - said > SILENT:  # several threads say something, and one line too many is no harm
            said = now
            line = f"Kinboard's kernels, {now - started:.0f} s: {what:40}"
            print(line, end="\r" if terminal else "\n", file=sys.stderr, flush=True)

    try:
        made = texts(given.folder / "texts", say, given.checked)
        with tempfile.TemporaryDirectory(prefix="kinboard-zig-") as zig:
            # By itself zig keeps each object once more, and that in the home of the user, who may have none.
            os.environ["ZIG_GLOBAL_CACHE_DIR"] = zig
            print(build(made, given.folder, given.level, given.system, say))
        prune(given.folder)
    except (BuildError, OutsideSubsetError) as error:
        print(error)
        return 1
    finally:
        if terminal and said > started - 1.0:
            print(file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
