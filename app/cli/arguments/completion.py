"""``kinboard completion``: what bash, zsh and fish complete, made of the parsers of the commands.

The scripts hold all words, so a shell need not start Kinboard when a key is pressed.
"""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

SHELLS = ("bash", "zsh", "fish")
_ROBOTS = ("ROBOT", "REFERENCE", "OTHER")  # metavars of arguments that are an id, or a file


class Flag(NamedTuple):
    """An option.

    Attributes:
        names: such as ``-o`` and ``--output``.
        text: one clause.
        value: name of its value; empty if it has none.
        words: the values that are valid, if they are a few words.
    """

    names: tuple[str, ...]
    text: str
    value: str
    words: tuple[str, ...]


class Page(NamedTuple):
    """What can follow a command, such as ``fk`` or ``room open``; the first page has no name.

    Attributes:
        below: the commands after it, with a clause each.
        words: what its arguments may be, besides files.
    """

    name: str
    flags: tuple[Flag, ...]
    below: Mapping[str, str]
    words: tuple[str, ...]


def add_completion(commands: Any, _: object) -> argparse.ArgumentParser:
    """``kinboard completion``."""
    about = "print a script with which a shell completes commands, options and robots"
    parser: argparse.ArgumentParser = commands.add_parser("completion", help=about, description=about)
    parser.add_argument("shell", choices=SHELLS, metavar="SHELL", help="bash, zsh or fish")
    return parser


def script(shell: str, parser: argparse.ArgumentParser) -> str:
    """The script for a shell, of the parser of all commands."""
    return _WRITERS[shell](list(_pages(parser)))


def _pages(parser: argparse.ArgumentParser, name: str = "") -> Iterator[Page]:
    flags, below, words = [], dict[str, str](), list[str]()
    parsers: dict[str, argparse.ArgumentParser] = {}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            parsers = dict(action.choices)
            below = {each.dest: _clause(each.help) for each in action._choices_actions}
            continue
        choices = tuple(map(str, action.choices or ()))
        if action.option_strings:
            metavar = action.metavar[0] if isinstance(action.metavar, tuple) else action.metavar
            value = "" if action.nargs == 0 else metavar or action.dest
            flags.append(Flag(tuple(action.option_strings), _clause(action.help), value, choices))
        else:
            words += choices or (robots() if action.metavar in _ROBOTS else ())
    yield Page(name, tuple(flags), below, tuple(dict.fromkeys(words)))
    for word, each in parsers.items():
        yield from _pages(each, f"{name} {word}".strip())


@cache
def robots() -> tuple[str, ...]:
    """The ids of the built-in robots, by the names of their files: the core is not imported."""
    found = find_spec("kin")
    assert found is not None
    assert found.submodule_search_locations
    return tuple(sorted(file.stem for file in Path(found.submodule_search_locations[0]).glob("robots/**/*.toml")))


def _clause(text: str | None) -> str:
    """The first clause of a help text."""
    return re.split(r"[;:.(]\s|[;:.]$", (text or "") + " ")[0].strip().replace("%%", "%")[:100]


def _bash(pages: list[Page]) -> str:
    values, arguments = [], []
    for page in pages:
        for flag in page.flags:
            if flag.value:
                names = "|".join(f'"{page.name}:{name}"' for name in flag.names)
                values.append(f'        {names}) words="{" ".join(flag.words)}" ;;')
        flags = " ".join(name for flag in page.flags for name in flag.names)
        arguments.append(f'        "{page.name}:-"*) words="{flags}" ;;')
        if words := [*page.below, *page.words]:
            arguments.append(f'        "{page.name}:"*) words="{" ".join(words)}" ;;')
    nested = "|".join(sorted({page.name.split()[0] for page in pages if " " in page.name})) or "''"
    return "\n".join(
        [
            '# Completion for bash: eval "$(kinboard completion bash)"',
            "_kinboard() {",
            "    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} page= words=",
            "    ((COMP_CWORD > 1)) && page=${COMP_WORDS[1]}",
            f'    case "$page" in {nested}) ((COMP_CWORD > 2)) && page="$page ${{COMP_WORDS[2]}}" ;; esac',
            '    case "$page:$prev" in',
            *values,
            '    *) case "$page:$cur" in',
            *arguments,
            "    esac ;;",
            "    esac",
            '    COMPREPLY=($(compgen -W "$words" -- "$cur"))',
            "}",
            "complete -o default -F _kinboard kinboard  # files, where nothing else fits",
            "",
        ]
    )


def _zsh(pages: list[Page]) -> str:
    lines = ['# Completion for zsh, after compinit: eval "$(kinboard completion zsh)"']
    for page in pages:
        lines.append(f"{_function(page.name)}() {{")
        if page.below:
            named = " ".join(_quoted(f"{word}:{text}") for word, text in page.below.items())
            lines += [
                f"    local -a below=({named})",
                "    if ((CURRENT == 2)) && [[ $words[2] != -* ]]; then _describe command below; return; fi",
                "    case $words[2] in",
                *(
                    f"    {word}) shift words; ((CURRENT--)); {_function(f'{page.name} {word}')}; return ;;"
                    for word in page.below
                ),
                "    esac",
            ]
        specs = [_zsh_flag(flag) for flag in page.flags]
        words = f"compadd {' '.join(page.words)}; " if page.words else ""
        specs.append(_quoted("*:argument:{" + words + "_files}"))
        lines += ["    _arguments -S " + " ".join(specs), "}"]
    return "\n".join([*lines, "compdef _kinboard kinboard", ""])


def _zsh_flag(flag: Flag) -> str:
    text = re.sub(r"[\[\]:'\"\\`$]", "", flag.text)
    value = ""
    if flag.value:
        value = f":{flag.value}:" + (f"({' '.join(flag.words)})" if flag.words else "_files")
    return " ".join(_quoted(f"*{name}[{text}]{value}") for name in flag.names)


def _function(name: str) -> str:
    return "_kinboard" + "".join(f"_{part}" for part in name.split())


def _fish(pages: list[Page]) -> str:
    lines = ["# Completion for fish: kinboard completion fish | source"]
    for page in pages:
        seen = [f"__fish_seen_subcommand_from {word}" for word in page.name.split()]
        nothing = f"not __fish_seen_subcommand_from {' '.join(page.below)}" if page.below else ""
        condition = _quoted("; and ".join(filter(None, [*seen, nothing])))
        start = f"complete -c kinboard -n {condition}"
        lines += [f"{start} -f -a {word} -d {_quoted(text)}" for word, text in page.below.items()]
        if page.words:
            lines.append(f"{start} -a {_quoted(' '.join(page.words))}")
        for flag in page.flags:
            named = (f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in flag.names)
            value = f" -x -a {_quoted(' '.join(flag.words))}" if flag.words else " -r" if flag.value else ""
            lines.append(f"{start} {' '.join(named)}{value} -d {_quoted(flag.text)}")
    return "\n".join([*lines, ""])


_quoted = shlex.quote
_WRITERS: Mapping[str, Callable[[list[Page]], str]] = {"bash": _bash, "zsh": _zsh, "fish": _fish}
