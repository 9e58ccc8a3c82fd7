"""Names that have moved: they work, warn with the new name, and go with the version that was announced."""

from __future__ import annotations

import re

import pytest

import app
import kin
from kin.deprecated import MOVED


def version(text):
    return tuple(map(int, re.findall(r"\d+", text)))


@pytest.mark.parametrize("package", [kin, app])
@pytest.mark.parametrize("name", MOVED)
def test_an_old_name_works_and_warns(name, package):
    to = MOVED[name]
    said = re.escape(f"kin.{name} is now kin.{to.instead or to.place}; the old name goes with version {to.gone}")
    with pytest.warns(DeprecationWarning, match=said):
        old = getattr(package, name)
    new = kin
    for part in to.place.split("."):
        new = getattr(new, part)
    assert old is new
    assert name not in kin.__all__


def test_the_warning_names_the_line_that_uses_the_old_name():
    with pytest.warns(DeprecationWarning, match="kin.section") as warned:
        _ = kin.section
    assert warned[0].filename == __file__


@pytest.mark.parametrize("name", MOVED)
def test_an_old_name_goes_when_it_was_announced(name):
    assert version(kin.__version__) < version(MOVED[name].gone)


def test_a_name_that_never_was_is_no_attribute():
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = kin.nothing


def test_everything_is_warmed_up_on_request(monkeypatch):
    done = []
    monkeypatch.setattr(kin.warmup, "warm_up_rest", lambda: done.append("rest"))
    monkeypatch.setattr(kin.warmup, "one_of_each_family", lambda: (kin.get_robot("planar2r"),))
    kin.warm_up()
    assert done == []
    kin.warm_up(everything=True)
    assert done == ["rest"]
