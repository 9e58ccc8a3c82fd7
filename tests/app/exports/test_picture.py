"""The picture of a workspace: what it counts, where it draws, and that it is a picture at all."""

from __future__ import annotations

import base64
import io
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from PIL import Image

import kin
from app.exports.picture import CELLS, SCALE, SIZE, Picture, coloured, draw
from app.exports.svg import png, tick_labels, ticks

ARM = kin.get_robot("pioneer5")
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def facts():
    return kin.workspace.workspace_facts(ARM, volume=False)


@pytest.fixture(scope="module")
def section():
    return kin.workspace.workspace_section(ARM, resolution=24)


@pytest.fixture(scope="module")
def drawing(facts, section):
    return ET.fromstring(draw(ARM, kin.workspace.sample_workspace(ARM, 20_000, chunk=4096), facts, section))


def images(drawing):
    found = []
    for image in drawing.iter(f"{SVG}image"):
        kind, data = image.attrib["href"].split(",", 1)
        assert kind == "data:image/png;base64"
        found.append(np.asarray(Image.open(io.BytesIO(base64.b64decode(data)))))
    return found


def test_there_are_three_views_and_the_section_each_with_its_axes(drawing):
    words = [text.text for text in drawing.iter(f"{SVG}text")]
    titles = ["seen along z, from above", "seen along y", "seen along x", "section through the axis of joint 1"]
    assert [word for word in words if word in titles] == titles
    assert [words.count(f"{name} (mm)") for name in "xyzr"] == [2, 2, 3, 1]
    assert any("20\u202f000 points" in word for word in words)
    assert any("reach 487 mm" in word for word in words)


def test_every_view_has_one_scale(drawing, facts):
    for image, (a, b) in zip(drawing.iter(f"{SVG}image"), ("xy", "xz", "yz"), strict=False):
        for name, length in ((a, "width"), (b, "height")):
            span = getattr(facts, name)
            metres = span.largest.value - span.least.value
            widest = facts.x.largest.value - facts.x.least.value
            assert float(image.attrib[length]) == pytest.approx(metres / widest * SIZE, abs=0.1)


def test_every_point_is_counted_once_where_it_is(facts, section):
    picture = Picture(ARM, facts, section)
    for chunk in kin.workspace.sample_workspace(ARM, 5000, chunk=1000):
        picture.add(chunk)
    assert [int(counts.sum()) for counts in picture._counts] == [5000] * 4
    point = next(kin.workspace.sample_workspace(ARM, 1)).points[0]
    alone = Picture(ARM, facts, section)
    alone.add(next(kin.workspace.sample_workspace(ARM, 1)))
    i, j = np.argwhere(alone._counts[0])[0]
    assert facts.x.least.value + (i + 0.5) * alone._cell == pytest.approx(point[0], abs=alone._cell)
    assert facts.y.least.value + (j + 0.5) * alone._cell == pytest.approx(point[1], abs=alone._cell)
    assert alone._counts[0].shape[0] == CELLS


def test_up_is_up():
    counts = np.zeros((3, 2), dtype=np.int64)
    counts[2, 1] = 9  # right, up
    rgba = coloured(counts)
    assert rgba.shape == (2, 3, 4)
    assert rgba[0, 2].tolist() == [*SCALE[-1].astype(int), 255]
    assert rgba[..., 3].sum() == 255, "cells with nothing are clear"


def test_the_boundary_and_its_arcs_are_drawn(drawing, section):
    thick = [path.attrib["stroke-width"] for path in drawing.iter(f"{SVG}path") if "stroke-width" in path.attrib]
    assert thick.count("1.6") == len(section.curves)
    assert thick.count("3") == len(section.arcs)
    legend = {text.text for text in drawing.iter(f"{SVG}text") if re.fullmatch(r"joint \d", text.text or "")}
    assert legend == {f"joint {arc.joint + 1}" for arc in section.arcs}


@pytest.mark.parametrize(
    ("ends", "unit", "first", "last"),
    [((-0.4, 0.4), 1e3, "−400", "400"), ((0.0, 0.012), 1e3, "0", "12"), ((-0.4, 0.4), 1.0, "−0.4", "0.4")],
)
def test_tick_labels_have_just_enough_decimals(ends, unit, first, last):
    texts = [text for _, text in tick_labels(*ends, unit)]
    assert (texts[0], texts[-1]) == (first, last)
    assert len(set(texts)) == len(texts)


def test_a_png_holds_exactly_the_given_pixels():
    rgba = np.random.default_rng(0).integers(0, 256, (5, 7, 4), dtype=np.uint8)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png(rgba)))), rgba)


def test_an_arm_without_a_section_has_three_views():
    stanford = kin.get_robot("scara")
    facts = kin.workspace.workspace_facts(stanford, volume=False)
    drawing = ET.fromstring(draw(stanford, kin.workspace.sample_workspace(stanford, 1000), facts, None))
    assert len(list(drawing.iter(f"{SVG}image"))) == 3


def test_a_flat_workspace_is_drawn(tmp_path):
    (tmp_path / "flat.toml").write_text(
        'id = "flat"\nname = "Flat & <thin>"\ndescription = ""\nsource = "test"\nconvention = "standard"\n'
        'units = { length = "mm", angle = "deg" }\n'
        '[[rows]]\nname = "a"\na = 300\nlimits = [-90, 90]\n[[rows]]\nname = "b"\na = 200\nlimits = [-90, 90]\n'
    )
    flat = kin.load_robot(tmp_path / "flat.toml")
    facts = kin.workspace.workspace_facts(flat, volume=False)
    text = draw(
        flat,
        kin.workspace.sample_workspace(flat, 1000),
        facts,
        kin.workspace.workspace_section(flat, resolution=16),
    )
    assert "Flat &amp; &lt;thin&gt;" in text
    assert len(list(ET.fromstring(text).iter(f"{SVG}image"))) == 4


@pytest.mark.parametrize(("low", "high"), [(-0.487, 0.486), (0.0, 1.08), (-1e-3, 2e-3), (100.0, 100.5)])
def test_ticks_are_round_and_few(low, high):
    found = ticks(low, high)
    assert 3 <= len(found) <= 9
    assert low - 1e-12 <= found[0]
    assert found[-1] <= high + 1e-12
    step = found[1] - found[0]
    assert np.allclose(np.array(found) / step, np.rint(np.array(found) / step))


def test_pictures_of_as_many_points_as_one_likes_have_one_size(facts, section):
    sizes = [len(draw(ARM, kin.workspace.sample_workspace(ARM, n), facts, section)) for n in (300_000, 1_200_000)]
    assert sizes[1] < 1.5 * sizes[0]
