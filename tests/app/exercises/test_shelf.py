"""The folder of exercises: read again while the service runs, and saved into by pages of several processes."""

from __future__ import annotations

import logging
import os
import shutil
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from app.exercises import Exercise, ExerciseFileError, Exercises, Shelf, builtin_exercises, parse_exercise
from app.exercises import shelf as shelves
from app.exercises.shelf import digest, written_in_a_page
from kin import InputError
from kin.parsing import to_toml

DATA = Path(__file__).parents[2] / "data"
SOURCE = next(one for one in builtin_exercises() if one.id == "elbow-angle")


def text(name: str = "mine", **fields: object) -> str:
    """The file of an exercise with this id."""
    return to_toml({**tomllib.loads(SOURCE.source), "id": name, "title": "Mine", **fields})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (made := tmp_path / "exercises").mkdir()
    return made


@pytest.fixture
def no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    """The list looks at the folder each time."""
    monkeypatch.setattr(shelves, "EVERY", 0.0)


def titled(known: Exercises) -> list[str]:
    return [one.title for one in known.all if not one.builtin]


def test_what_one_process_saves_another_one_lists_and_opens(folder: Path, no_pause: None) -> None:
    here, there = Exercises(folder), Exercises(folder)
    saved = here.save(text())
    assert (folder / "mine.toml").read_text() == text()
    assert here.get("mine") is saved
    assert titled(here) == titled(there) == ["Mine"]
    opened = there.get("mine")
    assert opened is not None
    opened.verify()
    assert written_in_a_page(opened)
    assert titled(Exercises(folder)) == ["Mine"], "the service starts with it"
    assert sorted(path.name for path in folder.iterdir()) == ["mine.toml"], "nothing else is left there"


def test_a_file_in_the_layout_of_an_earlier_version_can_be_changed_in_a_page(folder: Path) -> None:
    (folder / "old.toml").write_text(
        (DATA / "exercise-1.0.toml").read_text().replace("axis-counterexample", "old")
    )
    old = Exercises(folder).get("old")
    assert old is not None
    assert written_in_a_page(old)


def test_an_id_that_is_not_known_is_looked_for_at_once(folder: Path) -> None:
    here, there = Exercises(folder), Exercises(folder)
    assert there.get("mine") is None
    here.save(text())
    assert there.get("mine") is not None


@pytest.mark.full
def test_it_is_replaced_only_by_who_knows_what_is_there(folder: Path) -> None:
    here, there = Exercises(folder), Exercises(folder)
    first = here.save(text())
    second = there.save(text(title="Better"), digest(first.source))
    assert second.title == "Better"
    for before in ("", digest(first.source), "junk"):
        with pytest.raises(InputError, match="“Better” has it"):
            here.save(text(title="Older"), before)
    assert tomllib.loads((folder / "mine.toml").read_text())["title"] == "Better"


def test_an_id_of_a_built_in_exercise_or_of_another_file_is_taken(folder: Path) -> None:
    (folder / "other-name.toml").write_text("# by hand\n" + text("by-hand"))
    (folder / "broken.toml").write_text(text("fine"))
    known = Exercises(folder)
    (folder / "half.toml").write_text("id =")
    for name, words in (
        (SOURCE.id, SOURCE.title),
        ("by-hand", "“Mine” has it"),
        ("half", "a file of the folder has this name"),
        ("con", "every system"),
        ("lpt1", "every system"),
    ):
        with pytest.raises(InputError, match=words):
            known.save(text(name))
    by_hand = known.get("by-hand")
    assert by_hand is not None
    assert not written_in_a_page(by_hand), "its comment would be lost"


@pytest.mark.parametrize(
    "name", ["../mine", "a/b", "/tmp/x", ".hidden", "", "a" * 41, "A", "mi\nne", "m.toml", "ü"]
)
def test_no_id_leads_out_of_the_folder(folder: Path, name: str) -> None:
    with pytest.raises(ExerciseFileError, match="id: got"):
        Exercises(folder).save(text(name))
    assert list(folder.iterdir()) == []
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]


def test_a_link_that_somebody_put_there_is_not_followed(folder: Path, tmp_path: Path) -> None:
    known = Exercises(folder)
    (folder / "mine.toml").symlink_to(tmp_path / "elsewhere.toml")
    with pytest.raises(InputError, match="a file of the folder has this name"):
        known.save(text())
    assert not (tmp_path / "elsewhere.toml").exists()


@pytest.mark.full
def test_of_many_who_save_one_id_at_once_one_succeeds(folder: Path) -> None:
    services = [Exercises(folder) for _ in range(8)]

    def save(number: int) -> str:
        try:
            return services[number].save(text(title=f"Number {number}")).title
        except InputError:
            return ""

    with ThreadPoolExecutor(8) as pool:
        titles = [title for title in pool.map(save, range(8)) if title]
    assert len(titles) == 1
    assert [tomllib.loads(path.read_text())["title"] for path in folder.iterdir()] == titles


def test_what_a_process_left_behind_while_it_saved_is_in_nobodys_way_for_long(folder: Path) -> None:
    part = folder / ".mine.saving"
    part.write_text("id = ")
    known = Exercises(folder)
    with pytest.raises(InputError, match="nobody else saves now"):
        known.save(text())
    os.utime(part, (0, 0))
    assert known.save(text()).title == "Mine"
    assert [path.name for path in folder.iterdir()] == ["mine.toml"]


def test_why_nothing_can_be_saved_is_said(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert "KINBOARD_EXERCISES" in Exercises().obstacle
    with pytest.raises(InputError, match="KINBOARD_EXERCISES"):
        Exercises().save(text())
    known = Exercises(folder)
    assert known.obstacle == ""
    with monkeypatch.context() as patched:  # root may write everywhere
        patched.setattr(os, "access", lambda *_: False)
        assert "cannot be written" in known.obstacle
    with monkeypatch.context() as patched:
        patched.setattr(shelves, "MOST_FILES", 0)
        with pytest.raises(InputError, match="at most 0"):
            known.save(text())
    with monkeypatch.context() as patched:

        def full(number: int) -> None:
            raise OSError(28, "No space left on device")

        patched.setattr(os, "fsync", full)
        with pytest.raises(InputError, match="No space left on device"):
            known.save(text())
    assert list(folder.iterdir()) == [], "no half file"
    shutil.rmtree(folder)
    assert "is gone" in known.obstacle


def test_files_that_the_operator_copies_there_are_listed_and_invalid_ones_are_logged(
    folder: Path, no_pause: None, caplog: pytest.LogCaptureFixture
) -> None:
    known = Exercises(folder)
    (folder / "a.toml").write_text(text("a"))
    (folder / "b.toml").write_text("id = 1")
    (folder / "c.toml").write_text(text("a", title="Twice"))
    (folder / "d.toml").write_text(text(SOURCE.id))
    (folder / "e.txt").write_text(text("e"))
    with caplog.at_level(logging.WARNING, "kinboard.exercises"):
        assert titled(known) == ["Mine"]
        lines = len(caplog.records)
        assert lines == 3
        assert known.get("e") is None
        assert len(caplog.records) == lines, "once for each version of a file"
    (folder / "b.toml").write_text(text("b", title="Mended"))
    assert sorted(titled(known)) == ["Mended", "Mine"]
    assert known.get(SOURCE.id) is next(one for one in builtin_exercises() if one.id == SOURCE.id)


def test_a_folder_that_goes_away_takes_nothing_with_it(folder: Path, no_pause: None) -> None:
    known = Exercises(folder)
    known.save(text())
    shutil.rmtree(folder)
    assert titled(known) == ["Mine"]
    assert known.get("nobody") is None
    folder.mkdir()
    assert titled(known) == ["Mine"]
    known.save(text("again", title="Again"))
    assert sorted(titled(known)) == ["Again", "Mine"]


def own(name: str, title: str) -> Exercise:
    return parse_exercise(text(name, title=title))


@pytest.mark.full
def test_a_page_has_its_own_in_place_of_the_folders_but_of_no_built_in_one(folder: Path, no_pause: None) -> None:
    known = Exercises(folder)
    page = Shelf(known)
    page.put([own("mine", "Of the page"), own(SOURCE.id, "Not the library’s")], weak=[own("weak", "Weak")])
    known.save(text())
    known.save(text("weak", title="Of the service"))
    assert [page.get(name).title for name in ("mine", SOURCE.id, "weak")] == [  # type: ignore[union-attr]
        "Of the page",
        SOURCE.title,
        "Of the service",
    ]
    assert [page.is_own(name) for name in ("mine", SOURCE.id, "weak", "nobody")] == [True, False, False, False]
    assert sorted(titled(page)) == ["Of the page", "Of the service"]
    page.put(())
    assert sorted(titled(page)) == ["Mine", "Of the service"]
