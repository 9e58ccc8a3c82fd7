"""README, CONTRIBUTING, CHANGELOG, the pages of docs/ and the Dockerfile agree with the code."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import get_args
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest
from fastapi.testclient import TestClient
from lesson_arms import arms_of
from versions import needs_ompl

import kin
from app.cli.parser import main, subcommands
from app.exercises import builtin_exercises
from app.exercises.kinds import KINDS
from app.exports.formats import FORMATS
from app.service.main import create_app
from app.shared.settings import Settings
from app.viewer.lessons import LESSONS
from kin.ik.results import Cause
from kin.units import Units
from scripts import figures, surface

ROOT = Path(__file__).parents[1]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
}
README = PAGES["README.md"]


def blocks(language: str, *pages: str) -> list[str]:
    """The code blocks of a language on the named pages, by default on all of them."""
    texts = [PAGES[page] for page in pages or PAGES]
    pattern = rf"^```{language}\n(.*?)^```$"
    return [block for text in texts for block in re.findall(pattern, text, re.DOTALL | re.MULTILINE)]


def table(text: str, header: str) -> list[list[str]]:
    """Cells of the table whose first header cell is `header`."""
    lines = text.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(f"| {header} |"))
    rows = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def commands() -> list[tuple[str, list[str]]]:
    """Each `$ command` of the console blocks, with the lines shown under it."""
    found: list[tuple[str, list[str]]] = []
    for line in "".join(blocks("console")).splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        else:
            found[-1][1].append(line)
    return found


@pytest.mark.parametrize(
    "code", [pytest.param(code, marks=needs_ompl if "find_way" in code else ()) for code in blocks("python")]
)
def test_python_examples_run(code):
    exec(compile(code, "example", "exec"), {})


def test_the_course_hour_runs():
    """Its cells check their own numbers; it is stored without outputs, and asks before it shows."""
    cells = json.loads((ROOT / "examples" / "course_hour.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, object] = {}
    with np.printoptions():  # the first cell sets how arrays are printed
        for before, cell in pairwise(cells):
            if cell["cell_type"] == "code":
                assert (cell["outputs"], cell["execution_count"]) == ([], None), cell["id"]
                assert cell["id"] == "imports" or "*Predict" in "".join(before["source"]), cell["id"]
                exec(compile("".join(cell["source"]), cell["id"], "exec"), names)


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment in which `kinboard` is the command line of this checkout."""
    folder = tmp_path_factory.mktemp("bin")
    program = folder / "kinboard"
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m app.cli "$@"\n')
    program.chmod(0o755)
    return {**os.environ, "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}


@pytest.mark.full
@pytest.mark.parametrize(("command", "shown"), commands(), ids=[command for command, _ in commands()])
def test_command_line_examples_run_and_print_what_is_shown(shell, tmp_path, monkeypatch, capsys, command, shown):
    """In a folder with the checkout's data, where the files that they write are left; pipes in a shell."""
    assert "kinboard " in command
    for folder in ("tests", "kin/robots"):
        (tmp_path / folder).parent.mkdir(exist_ok=True)
        (tmp_path / folder).symlink_to(ROOT / folder)
    if re.search(r"[|<>&;$#]", command):
        words = ["bash", "-o", "pipefail", "-c", command]
        done = subprocess.run(words, cwd=tmp_path, env=shell, capture_output=True, text=True, check=False)
        code, out, err = done.returncode, done.stdout, done.stderr
    else:
        monkeypatch.chdir(tmp_path)
        code = main(shlex.split(command)[1:])
        out, err = capsys.readouterr()
    assert code == 0, err
    assert out.strip()
    assert "error" not in err
    printed = {" ".join(line.split()) for line in out.splitlines()}
    for line in shown:
        assert " ".join(line.split()) in printed


def test_the_page_of_the_command_line_has_every_command_and_no_other_option():
    page = PAGES["docs/cli.md"]
    helps = {name: command.format_help() for name, command in subcommands().items()}
    for name in helps:
        known = "".join(text for other, text in helps.items() if f"{other} ".startswith(f"{name} "))
        assert re.search(rf"`kinboard {name}[ `]|^## .*\b{name}\b", page, re.MULTILINE), name
        for text in re.findall(rf"kinboard {name}\b([^`|\n]*)", page):
            for option in re.findall(r"(?<!\S)--[a-z][a-z-]*", text):
                assert option in known, f"{name} {option}"
    for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", page):
        assert option in "".join(helps.values()), option


@pytest.mark.full
def test_rest_examples_are_answered():
    lines = dict.fromkeys(
        line for block in blocks("sh") for line in block.splitlines() if line.startswith("curl ")
    )
    client = TestClient(create_app(Settings(time_budget=120)))
    answers = {}
    for line in lines:
        words = shlex.split(line)
        url = urlsplit(next(word for word in words if word.startswith("http://")))
        assert url.netloc == f"127.0.0.1:{Settings.model_fields['port'].default}"
        if "-d" in words:
            headers = dict([words[words.index("-H") + 1].split(": ", 1)])
            answer = client.post(url.path, content=words[words.index("-d") + 1], headers=headers)
        else:
            answer = client.get(f"{url.path}?{url.query}")
        assert answer.status_code == 200, answer.text
        answers[url.path.rsplit("/", 1)[1]] = answer
    examples = {"fk", "ik", "motion", "workspace", "summary", "reachable", "capability", "touch-postures"}
    assert set(answers) == examples
    assert len(answers["touch-postures"].json()["q"]) == 12
    assert answers["ik"].json()["status"] == "solved"
    assert [one["reachable"] for one in answers["reachable"].json()["results"]] == [True, False]
    assert answers["workspace"].text.startswith("x,y,z,manipulability,q1,")


def test_the_status_table_lists_every_status():
    assert [row[0].strip("`") for row in table(PAGES["docs/rest.md"], "`status`")] == [
        status.value for status in kin.Status
    ]


def test_the_table_of_causes_lists_every_cause():
    causes = [row[0].strip("`") for row in table(PAGES["docs/rest.md"], "`cause`")]
    assert causes == [cause for cause in get_args(Cause) if cause]


def test_the_settings_table_is_the_settings():
    rows = table(PAGES["docs/settings.md"], "variable")
    expected = []
    for name, field in Settings.model_fields.items():
        default = list(field.default) if isinstance(field.default, tuple) else field.default
        default = str(default).lower() if isinstance(default, bool) else default
        shown = "" if default in (None, "") else f"`{default}`"
        expected.append([f"`KINBOARD_{name.upper()}`", shown, field.description])
    assert rows == expected


def test_lists_are_read_from_the_environment_as_documented(monkeypatch):
    name, value = re.search(r"`(KINBOARD_ALLOWED_ORIGINS)='([^']+)'`", PAGES["docs/settings.md"]).groups()
    monkeypatch.setenv(name, value)
    assert Settings().allowed_origins == tuple(json.loads(value))


def test_the_robot_file_is_a_robot():
    robot_file, *others = blocks(
        "toml",
        "docs/robot-files.md",
        *(set(PAGES) - {"docs/exercises.md", "docs/lessons.md", "docs/robot-files.md", "docs/motion.md"}),
    )
    assert not others
    robot = kin.load_robot(robot_file)
    assert kin.fk(robot, [0.0, 0.0])[:3, 3].tolist() == [0.5, 0.0, 0.0]


def test_the_programs_can_be_driven():
    for text in blocks("toml", "docs/motion.md"):
        robot = kin.get_robot("panda")
        assert kin.plan_motion(robot, kin.motion.parse_program(text, robot)).planned


def test_the_built_in_arms_are_named():
    rows = [
        (robot_id, row[1])
        for row in table(PAGES["docs/robot-files.md"], "arm")
        for robot_id in re.findall(r"`(.+?)`", row[0])
    ]
    classics = kin.files.classic_robots()
    assert sorted(rows) == sorted((robot.id, str(robot.n)) for robot in classics.values())
    assert len(classics) == 12
    assert "Twelve are classics" in PAGES["docs/robot-files.md"]
    assert f"**{len(kin.builtin_robots())} arms**" in README


def test_the_page_of_a_solver_names_built_in_arms_that_it_solves():
    solved: dict[str, set[str]] = {}
    for robot_id, solver in re.findall(
        r"^\| !.*\| `([\w-]+)` \| \d .*\| `(\w+)` \|$", PAGES["docs/arms.md"], re.MULTILINE
    ):
        solved.setdefault(solver, set()).add(robot_id)
    assert sum(map(len, solved.values())) == len(kin.builtin_robots())
    pages = {name: PAGES[f"docs/background/{name}.md"].splitlines()[2] for name in solved}
    named = {name: set(re.findall(r"`([\w-]+)`", line.partition(" · ")[2])) for name, line in pages.items()}
    assert all(named[name] <= solved[name] for name in solved)
    assert {name for name in solved if named[name] != solved[name]} == {n for n in pages if "[others]" in pages[n]}
    without = {page for page, text in PAGES.items() if "· no built-in arm" in text}
    assert not without & {f"docs/background/{name}.md" for name in solved}


@pytest.mark.full
def test_the_page_of_arms_is_the_one_that_its_script_writes():
    done = subprocess.run(
        [sys.executable, "-c", "from scripts.arms_page import page; print(page(), end='')"],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"},
        capture_output=True,
        check=True,
    )
    assert done.stdout.decode() == PAGES["docs/arms.md"], "python scripts/arms_page.py writes it anew"
    pictures = {file.stem: file for file in (ROOT / "docs/images/arms").iterdir()}
    assert set(pictures) == set(kin.builtin_robots())
    assert max(file.stat().st_size for file in pictures.values()) < 6_000


def test_every_lesson_has_its_section():
    lessons = PAGES["docs/teaching.md"].partition("\n## Lessons\n")[2].partition("\n## ")[0]
    assert re.findall("^### (.+)$", lessons, re.MULTILINE) == ["Worksheets", *(lesson.title for lesson in LESSONS)]


def test_each_part_of_a_goal_has_steps_that_ask_for_it():
    asked, goals = {}, {}
    for lesson in LESSONS:
        outlines = [lesson.asked(robot, Units()) for robot in arms_of(lesson.key)]
        asked[lesson.title] = {step.title for outline in outlines for step in outline.steps if step.question}
        goals[lesson.title] = outlines[0].goal
    seen, title = dict.fromkeys(goals, ""), ""
    for first, goal, steps in table(PAGES["docs/teaching.md"], "lesson | after it, you can …"):
        title = first or title
        assert goal in goals[title]
        assert steps == "check" or set(steps.split(", ")) <= asked[title], steps
        seen[title] += f"{goal} "
    for title, goal in goals.items():
        words = re.findall(r"\w+", goal.removeprefix("You can "))
        left = [word for word in words if word not in re.findall(r"\w+", seen[title])]
        assert set(left) <= {"and"}, f"{title}: no row of the table says {left}"


@pytest.mark.parametrize(
    ("page", "header", "names"), [("exercises", "`kind` | what is asked", KINDS), ("formats", "format", FORMATS)]
)
def test_tables_list_what_is_registered(page, header, names):
    assert {row[0].strip("`") for row in table(PAGES[f"docs/{page}.md"], header)} == set(names)


def test_the_two_commands_exist_and_ci_runs_the_second():
    assert blocks("sh", "README.md")[0] == "sh scripts/serve.sh\n"
    assert "sh scripts/test.sh\n" in blocks("sh", "README.md")
    assert (ROOT / "scripts/serve.sh").is_file()
    assert (ROOT / ".ci/run").read_text().splitlines()[-1] == "sh scripts/test.sh"


@pytest.mark.parametrize("script", [*ROOT.glob("scripts/*.sh"), ROOT / ".ci/run"], ids=lambda path: path.name)
def test_scripts_are_valid_shell(script):
    subprocess.run(["sh", "-n", script], check=True)


def slug(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


@pytest.mark.parametrize("document", [*PAGES, "CONTRIBUTING.md", "CHANGELOG.md"])
def test_links_between_files_lead_somewhere(document):
    path = ROOT / document
    for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        if "://" in link:
            continue
        target, _, anchor = link.partition("#")
        file = path.parent / unquote(target) if target else path
        assert file.exists(), link
        if anchor:
            headings = re.findall(r"^#+ (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in map(slug, headings), link


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built documentation; a warning of MkDocs is an error."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "mkdocs",
            "build",
            "--strict",
            "--site-dir",
            folder,
        ],  # --quiet hides warnings from --strict
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    output = done.stdout + done.stderr
    assert done.returncode == 0, output
    assert "WARNING" not in output
    return folder


class Resources(HTMLParser):
    """Collects what a page loads: addresses in `src` and `href` of the elements that fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("link", "script", "img", "iframe", "source", "object", "use", "image"):
            self.found += [value or "" for name, value in attrs if name in ("src", "href", "data", "srcset")]


def loaded(html: str) -> list[str]:
    parser = Resources()
    parser.feed(html)
    return parser.found


@pytest.mark.full
def test_the_site_has_its_figures(site):
    named = {
        name: page
        for page in (ROOT / "docs").rglob("*.md")
        for name in figures.COMMENT.findall(page.read_text(encoding="utf-8"))
    }
    assert set(named) == set(figures.FIGURES)
    for name, page in named.items():
        built = site / page.relative_to(ROOT / "docs").with_suffix("") / "index.html"
        (source,) = [each for each in loaded(built.read_text(encoding="utf-8")) if each.endswith(f"/{name}.html")]
        figure = (built.parent / source).resolve()
        assert figure == site / figures.address(name)
        assert kin.get_robot(name).name in figure.read_text(encoding="utf-8")


@pytest.mark.full
def test_each_arm_has_a_page_behind_its_picture_and_the_site_stays_small(site):
    arms = (site / "arms" / "index.html").read_text(encoding="utf-8")
    for name in kin.builtin_robots():
        assert f'href="../{figures.address(name)}"' in arms
        page = (site / figures.address(name)).read_text(encoding="utf-8")
        assert all((site / "figures" / each).is_file() for each in loaded(page) if each != "data:,")
    assert sum(file.stat().st_size for file in site.rglob("*") if file.is_file()) < 15_000_000


@pytest.mark.full
def test_the_site_loads_nothing_from_the_internet(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) > len(PAGES) - 1
    for page in pages:
        for address in loaded(page.read_text(encoding="utf-8")):
            assert not urlsplit(address).netloc, f"{page.name}: {address}"
    for style in site.rglob("*.css"):
        assert not re.search(r"url\(['\"]?(https?:)?//", style.read_text(encoding="utf-8")), style.name


def test_a_resource_from_the_internet_would_be_found():
    assert loaded('<link rel="stylesheet" href="https://fonts.example/a.css">') == ["https://fonts.example/a.css"]


@pytest.mark.full
def test_the_site_has_a_page_per_solver_and_every_public_function(site):
    for robot in kin.builtin_robots().values():
        solver = kin.solve_ik(robot, kin.fk(robot, robot.q_home), max_solutions=1).solver
        assert (site / "background" / solver / "index.html").is_file(), f"{robot.id}: {solver}"
    python = (site / "python" / "index.html").read_text(encoding="utf-8")
    for name, value in surface.public().items():
        if surface.described(value):
            assert f'id="kin.{name}"' in python or f'id="kin.fk.{name}"' in python, name


def test_the_picture_of_the_architecture_shows_every_room():
    picture = (ROOT / "docs/images/architecture.svg").read_text(encoding="utf-8")
    shown = set(re.findall(r">([a-z]+)</text>", picture))
    rooms = {folder.parent.name for package in ("kin", "app") for folder in (ROOT / package).glob("*/__init__.py")}
    assert rooms - shown == set()


def test_the_glossary_defines_each_term_once():
    rows = re.findall(r"^\| ([^|]+?) \|.*\|$", PAGES["docs/glossary.md"], re.MULTILINE)
    terms = [term for term in rows if term not in ("term", "---")]
    assert len(terms) > 50
    assert len(terms) == len(set(terms))


def test_drawings_are_small_and_self_contained():
    images = list((ROOT / "docs/images").iterdir())
    assert images
    for image in images:
        assert image.stat().st_size < 200_000, image.name
        if image.suffix == ".svg":
            links = set(re.findall(r"https?://[^\"'\s<>]+", image.read_text(encoding="utf-8")))
            assert links <= {"http://www.w3.org/2000/svg"}, image.name


def test_every_place_named_in_the_table_exists():
    rows = table(CONTRIBUTING, "what")
    assert len(rows) > 15
    for what, where in rows:
        paths = re.findall(r"`([^`]+)`", where)
        assert paths, what
        for path in paths:
            assert (ROOT / path).exists(), f"{what}: {path}"


def test_every_idea_of_the_numerics_is_where_the_architecture_says():
    text = PAGES["docs/architecture.md"]
    rows = [" ".join(row) for row in table(text, "idea")] + [row[0] for row in table(text, "loop")]
    assert len(rows) > 30
    for row in rows:
        quoted = re.findall(r"`([^`]+)`", row)
        homes = [ROOT / each for each in quoted if each.startswith("kin/")]
        assert homes, row
        assert all(home.exists() for home in homes), row
        files = [file for home in homes for file in ([home] if home.is_file() else home.glob("*.py"))]
        defined = "\n".join(file.read_text(encoding="utf-8") for file in files)
        for name in ".".join(each for each in quoted if not each.startswith("kin/")).split("."):
            assert not name or re.search(rf"^\s*(?:def|class) {name}\b", defined, re.MULTILINE), f"{name}: {row}"


def mapped_files() -> list[str]:
    """Folders of the map, put together from its indentation."""
    text = re.search(r"## Map\n.*?```\n(.*?)```", CONTRIBUTING, re.DOTALL).group(1)
    folders: list[str] = []
    found = []
    for line in text.splitlines():
        name = line.split()[0]
        depth = (len(line) - len(line.lstrip())) // 2
        folders[depth:] = [name]
        found.append("".join(folders))
    return found


def test_the_readme_leads_to_every_page():
    linked = set(re.findall(r"\]\(((?:docs/)?[\w./-]+\.md)", README))
    families = {page for page in PAGES if page.startswith("docs/background/")}
    listed = {f"docs/{name}" for name in re.findall(r"\]\(([\w./-]+\.md)", PAGES["docs/index.md"])}
    assert set(PAGES) - families - {"README.md"} <= linked
    assert "docs/connect.md" in listed


def test_exercises_and_arms_are_counted_rightly():
    for file in ("README.md", "docs/new.md"):
        text = (ROOT / file).read_text(encoding="utf-8")
        assert {int(found) for found in re.findall(r"(\d+)(?: exercises\*\*| in the page, with hints)", text)} == {
            len(builtin_exercises())
        }
        assert {int(found) for found in re.findall(r"(\d+) arms(?:\*\*)? are built in", text)} == {
            len(kin.builtin_robots())
        }


def test_the_map_names_every_folder_and_nothing_else():
    folders = {
        f"{path.parent.relative_to(ROOT).as_posix()}/"
        for package in ("kin", "app")
        for path in (ROOT / package).rglob("*.py")
    }
    assert sorted(mapped_files()) == sorted(folders | {"app/exercises/library/", "kin/robots/"})


def test_the_changelog_knows_this_version():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## \[(.+?)\]", text, re.MULTILINE)
    assert headings[:2] == ["Unreleased", kin.__version__]
    released = re.search(rf"^## \[{re.escape(kin.__version__)}\] – (\S+)$", text, re.MULTILINE)[1]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    assert {f"version: {kin.__version__}", f"date-released: {released}"} <= set(citation)


def test_the_image_starts_the_way_the_app_does():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert 'CMD ["kinboard", "serve"]' in DOCKERFILE
    assert "kinboard" in project["scripts"]
    assert f"ARG VERSION={kin.__version__}\n" in DOCKERFILE
    assert "image.version=$VERSION" in DOCKERFILE
    base = re.search(r"^ARG BASE=\S*python:(\d+\.\d+)-slim", DOCKERFILE, re.MULTILINE).group(1)
    assert f"Python :: {base}" in " ".join(project["classifiers"])
    variables = set(re.findall(r"\bKINBOARD_([A-Z_]+)=", DOCKERFILE.rpartition("\nFROM ")[2]))
    assert {name.lower() for name in variables} <= set(Settings.model_fields)
    assert re.search(r"^USER (\d+):\1$", DOCKERFILE, re.MULTILINE), "a number, for Kubernetes' runAsNonRoot"
    assert "/readyz" in DOCKERFILE.split("HEALTHCHECK")[1]


def test_the_image_gets_every_file_its_build_copies():
    ignore = (ROOT / ".dockerignore").read_text().split()
    for sources in re.findall(r"^COPY (?!--from)(.+) \S+$", DOCKERFILE, re.MULTILINE):
        for source in sources.split():
            assert f"!{source}" in ignore
            assert (ROOT / source).exists()


# WCAG 2.2, levels A and AA: the numbers of the criteria in each guideline.
CRITERIA = {
    "1.1": (1,),
    "1.2": range(1, 6),
    "1.3": range(1, 6),
    "1.4": (*range(1, 6), *range(10, 14)),
    "2.1": (1, 2, 4),
    "2.2": (1, 2),
    "2.3": (1,),
    "2.4": (*range(1, 8), 11),
    "2.5": (1, 2, 3, 4, 7, 8),
    "3.1": (1, 2),
    "3.2": (1, 2, 3, 4, 6),
    "3.3": (1, 2, 3, 4, 7, 8),
    "4.1": (2, 3),
}


def test_the_report_on_accessibility_has_each_criterion_and_names_tests_that_exist():
    rows = table(PAGES["docs/accessibility.md"], "criterion")
    expected = [f"{guideline}.{number}" for guideline, numbers in CRITERIA.items() for number in numbers]
    assert [name.split()[0] for name, *_ in rows] == expected
    files = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py")}
    for name, level, result, checked in rows:
        assert level in ("A", "AA"), name
        assert result in ("conforms", "in part", "no", "nothing of the kind"), name
        assert bool(checked) != (result == "nothing of the kind"), name
        for file, test in re.findall(r"`(test_\w+\.py)(?:::(\w+))?`", checked):
            assert f"def {test}" in files[file], f"{name}: {file}::{test}"
