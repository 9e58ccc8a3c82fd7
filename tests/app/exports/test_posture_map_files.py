"""Posture maps as files."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import kin
from app.exports.postures import FORMATS, SINGULAR, colours
from kin.units import typeset


@pytest.fixture(scope="module")
def found() -> kin.postures.PostureMap:
    return kin.posture_map("ur5", resolution=20)


def test_a_picture_says_in_words_what_it_shows(found):
    root = ElementTree.fromstring(FORMATS["svg"].write(found))
    text = {each.tag.rpartition("}")[2]: each.text for each in root}
    assert text["title"] == "Postures of UR5"
    assert text["desc"] == typeset(found.reason)
    words = [each.text for each in root.iter() if each.tag.endswith("text")]
    assert {region.name for region in found.regions} <= set(words)
    assert {str(number) for number in np.unique(found.counts)} <= set(words)
    strokes = [each.get("stroke") for each in root if each.tag.endswith("path") and each.get("fill") == "none"]
    assert strokes == [SINGULAR if curve.kind == "singular" else "currentColor" for curve in found.curves]


def test_a_plane_of_joints_has_axes_in_degrees_and_millimetres():
    robot = kin.get_robot("scara")
    text = FORMATS["svg"].write(kin.posture_map(robot, joints=(1, 2), resolution=10)).decode()
    assert f"{robot.joints[1].name}, °</text>" in text
    assert f"{robot.joints[2].name}, mm</text>" in text


def test_hostile_names_are_text(found):
    robot = replace(found.robot, name='<script>"&\x00')
    root = ElementTree.fromstring(FORMATS["svg"].write(replace(found, robot=robot)))
    assert root[0].text.startswith('Postures of <script>"&')


def test_an_image_has_a_square_for_each_node(found):
    image = np.asarray(Image.open(io.BytesIO(FORMATS["png"].write(found))).convert("RGB"))
    assert image.shape == (1000, 1000, 3)
    assert (image[25, 25] == colours(found.counts[0, -1:], 8)[0]).all()
    i, j = np.argwhere(found.counts == 8)[0]
    drawn = image[(19 - j) * 50 + 3 : (20 - j) * 50 - 3, i * 50 + 3 : (i + 1) * 50 - 3].reshape(-1, 3)
    assert (drawn == colours(np.array([8]), 8)[0]).all(axis=1).any()


def test_a_table_has_a_row_for_each_node(found):
    lines = FORMATS["csv"].write(found).decode().splitlines()
    assert len(lines) == 1 + found.counts.size
    x, y, number = lines[1 + 20 * 7 + 3].split(",")
    assert (float(x), float(y), int(number)) == (found.x[7], found.y[3], found.counts[7, 3])
