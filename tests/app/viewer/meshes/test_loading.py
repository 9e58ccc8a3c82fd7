"""Mesh files → surfaces: formats, colours, limits, sharp edges; and the process that reads them."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from live_server import wait_for
from zips import MTL, TWO_JOINTS, announced, obj, packed, robot_files

import kin
from app.shared.memory.answers import MemoryFullError
from app.viewer.meshes import reader as readers
from app.viewer.meshes.archive import MOST_BYTES, MeshError
from app.viewer.meshes.child import answer_to
from app.viewer.meshes.fitting import checked
from app.viewer.meshes.links import shapes_of
from app.viewer.meshes.loading import PARSED, finished, read_surfaces
from app.viewer.meshes.placing import Body, Fit, Piece
from app.viewer.meshes.reader import PACKAGES, ClientMeshes, Meshes, MeshReader
from app.viewer.meshes.surface import GREY, LinkBody, Surface, by_color, pack, unpack
from kin.files.urdf.visuals import read_visuals
from kin.fitting import Segment

ROOT = Path(__file__).parents[4]


def nothing_else(name: str) -> bytes:
    raise KeyError(name)


def exported(kind: str, color: tuple[int, int, int, int] | None = None) -> bytes:
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    if color is not None:
        material = trimesh.visual.material.PBRMaterial(baseColorFactor=color)
        box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(box.vertices), 2)), material=material)
    return bytes(trimesh.Scene(box).export(file_type=kind)) if kind == "glb" else bytes(box.export(file_type=kind))


@pytest.mark.parametrize("kind", ["stl", "glb", "dae"])
def test_each_format_is_read_in_metres(kind: str) -> None:
    (surface,) = read_surfaces(f"a/box.{kind}", exported(kind), nothing_else)
    assert np.allclose(surface.points.max(axis=0), (0.05, 0.1, 0.15))
    assert len(surface.faces) == 12


def test_a_unit_of_a_collada_file_counts() -> None:
    text = exported("dae").decode().replace('meter="1.0"', 'meter="0.001"')
    if 'meter="0.001"' not in text:
        text = text.replace("<asset>", '<asset><unit name="millimeter" meter="0.001"/>')
    (surface,) = read_surfaces("box.dae", text.encode(), nothing_else)
    assert np.allclose(surface.points.max(axis=0), (5e-5, 1e-4, 1.5e-4))


def test_colours_come_from_materials_beside_the_mesh_and_nothing_else_is_opened() -> None:
    asked: list[str] = []

    def read(name: str) -> bytes:
        asked.append(name)
        return MTL

    surfaces = {s.color: len(s.faces) for s in read_surfaces("two/meshes/fore.obj", obj(), read)}
    assert surfaces == {(255, 0, 0): 6, (255, 255, 255): 6}
    assert asked == ["bar.mtl"]
    (plain,) = read_surfaces("fore.obj", obj(), nothing_else)
    assert plain.color is None
    (red,) = read_surfaces("box.glb", exported("glb", (255, 0, 0, 255)), nothing_else)
    assert red.color == (255, 0, 0)


TOO_MANY = f"at most {PARSED} in a file"
GLB_HEAD = b'{"accessors":[{"count":300000000}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]}'
HOSTILE = {
    "ten-million.stl": (announced(10**7) + bytes(50), TOO_MANY),
    "huge.stl": (announced(PARSED + 1) + bytes(50 * (PARSED + 1)), TOO_MANY),
    "ascii.stl": (b"solid x\n" + b"facet endfacet " * (PARSED + 1), TOO_MANY),
    "many.obj": (b"v 0 0 0\n" + b"\nf 1 1 1" * (PARSED + 1), TOO_MANY),
    "many.dae": (b'<COLLADA><triangles material="m" count="10000000">', TOO_MANY),
    "bomb.dae": (b'<!DOCTYPE x [<!ENTITY a "aaaa">]><COLLADA>&a;</COLLADA>', "without DOCTYPE"),
    "many.glb": (
        b"glTF\x02\x00\x00\x00\x00\x00\x00\x00" + len(GLB_HEAD).to_bytes(4, "little") + b"JSON" + GLB_HEAD,
        TOO_MANY,
    ),
    "none.stl": (announced(0), "a mesh with triangles"),
    "nan.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "finite numbers"),
    "beyond.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "."),
    "noise.glb": (bytes(range(256)), "a mesh in the format .glb"),
    "noise.dae": (bytes(range(256)), "a mesh in the format .dae"),
    "noise.stl": (bytes(range(40)), "."),
    "archive.zip": (packed(robot_files()), "one of .stl"),
    "page.html": (b"<html>", "one of .stl"),
    "noending": (b"", "one of .stl"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_mesh_is_refused_by_name(name: str) -> None:
    data, expected = HOSTILE[name]
    with pytest.raises(MeshError) as caught:
        read_surfaces(name, data, nothing_else)
    assert name in caught.value.field
    assert expected in caught.value.expected or expected == "."


def test_sharp_edges_stay_sharp_and_round_ones_round() -> None:
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    ball = trimesh.creation.icosphere(3)
    for mesh, points in ((box, 24), (ball, len(ball.vertices))):
        loose = Surface(
            None,
            mesh.triangles.reshape(-1, 3).astype(np.float32),
            np.arange(3 * len(mesh.faces)).reshape(-1, 3).astype(np.uint32),
        )
        done = finished(loose, 1.0)
        assert len(done.points) == points
        assert len(done.faces) == len(mesh.faces)
        assert np.allclose(done.points[done.faces], mesh.triangles, atol=1e-5)


def test_a_fine_mesh_is_simplified_and_keeps_its_shape() -> None:
    ball = trimesh.creation.icosphere(5)
    done = finished(Surface(GREY, ball.vertices.astype(np.float32), ball.faces.astype(np.uint32)), 0.1)
    assert 0.05 * len(ball.faces) < len(done.faces) < 0.15 * len(ball.faces)
    assert np.abs(np.linalg.norm(done.points, axis=1) - 1.0).max() < 0.02


def test_rare_colours_join_the_closest_one() -> None:
    def patch(color: tuple[int, int, int] | None, count: int) -> Surface:
        return Surface(color, np.zeros((3, 3), np.float32), np.zeros((count, 3), np.uint32))

    found = by_color([patch((255, 0, 0), 9), patch((0, 0, 255), 8), patch((200, 20, 0), 1), patch(None, 2)], 2)
    assert {s.color: len(s.faces) for s in found} in (
        {(255, 0, 0): 12, (0, 0, 255): 8},
        {(255, 0, 0): 10, (0, 0, 255): 10},
    )


def test_surfaces_survive_the_way_between_processes() -> None:
    (first, second), triangles = unpack(pack(LINKS, 7), 2)
    assert triangles == 7
    assert [s.color for s in first.surfaces] == [(1, 2, 3), None]
    assert np.array_equal(first.surfaces[1].points, ONE.points)
    assert np.array_equal(first.cover, ONE.points)
    assert list(second.surfaces) == []


ONE = Surface((1, 2, 3), np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32))
LINKS = [LinkBody([ONE, ONE._replace(color=None)], ONE.points), LinkBody([], np.empty((0, 3), np.float32))]
WRONG = {
    "too many triangles": pack(LINKS),
    "an index that is none": pack([LinkBody([ONE._replace(faces=np.array([[0, 1, 3]], np.uint32))], ONE.points)]),
    "no number": pack([LinkBody([ONE._replace(points=np.full((3, 3), np.nan, np.float32))], ONE.points)]),
    "a longer answer": pack(LINKS[1:]) + b"more",
    "a shorter one": pack(LINKS[:1])[:-4],
    "a negative size": pack(LINKS[1:]).replace(b"[0,", b"[-1,"),
    "a size that is no number": pack(LINKS[1:]).replace(b"[0,", b'["1",'),
    "no colour": pack(LINKS[:1]).replace(b"[1, 2, 3]", b"[1, 2, 256]"),
    "no JSON": b"\x00\n",
}


@pytest.mark.parametrize("what", WRONG)
def test_an_answer_of_the_process_is_checked(what: str) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        unpack(WRONG[what], 1)


BODY = Body([], 1)
NO_FITS = {
    "none": [],
    "no list": None,
    "not finite": [Fit([[0, 0, 0, 0, 0, 1, math.nan]], [])],
    "no radius": [Fit([[0, 0, 0, 0, 0, 1, 0]], [])],
    "a number too few": [Fit([[0, 0, 0, 0, 0, 1]], [])],
    "too many": [Fit([[0, 0, 0, 0, 0, 1, 1]] * 10_000, [])],
    "another number of links": [Fit([], [])] * 2,
    "no number": [Fit([[0, 0, 0, 0, 0, None, 1]], [])],
}


@pytest.mark.parametrize("what", NO_FITS)
def test_capsules_that_the_process_answers_are_checked(what: str) -> None:
    with pytest.raises((ValueError, TypeError)):
        checked(NO_FITS[what], [BODY])


def test_every_number_of_an_answered_capsule_becomes_a_float() -> None:
    (fitted,) = checked([Fit([[0, 0, 0, 0, 0, 1, "0.1"]], [])], [BODY])
    assert fitted.capsules == [Segment((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1)]


TWO, URDF = kin.load_robot(TWO_JOINTS), "two/urdf/two.urdf"
SHAPES = shapes_of(TWO, read_visuals(TWO_JOINTS))


def read(mine: ClientMeshes, data: bytes, room: Any = None) -> Any:
    return mine.read(SHAPES, data, URDF, room)


@pytest.fixture(scope="module")
def reader():
    made = MeshReader()
    yield made
    made.close()


@pytest.mark.full
def test_the_process_reads_a_zip_and_its_memory_is_given_back(
    reader: MeshReader, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.shared.memory.answers.SMALL", 0)
    reports: list[tuple[int, int]] = []
    files, mine = packed(robot_files()), reader.of("a")
    meshes = mine.read(SHAPES, files, URDF, None, lambda *report: reports.append(report)).result()
    assert reports == [(0, 2), (1, 2)]
    assert meshes.triangles == 12 + 12
    assert [[len(s.faces) for s in link.surfaces] for link in meshes.links][1] == [12]
    assert {s.color for s in meshes.links[2].surfaces} > {(255, 0, 0), (255, 255, 255)}
    assert reader.memory.held > 0
    del meshes
    wait_for(lambda: reader.memory.held == 0)


@pytest.mark.full
def test_the_process_says_what_is_wrong_and_may_not_take_long(
    reader: MeshReader, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(MeshError) as caught:
        read(reader.of("a"), packed({**robot_files(), "two/meshes/upper.stl": b"x" * 100})).result()
    assert "upper.stl" in caught.value.field
    monkeypatch.setattr(readers, "PATIENCE", 0.01)
    with pytest.raises(MeshError, match="too much work"):
        read(reader.of("a"), packed(robot_files())).result()


class Queue(MeshReader):
    """A reader that notes whose meshes it reads, and waits until `go` is set before it has read any."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.go, self.begun = threading.Event(), threading.Event()
        self.order: list[str] = []

    def _read(self, request: readers._Request) -> Meshes:
        self.order.append(request.client)
        self.begun.set()
        assert self.go.wait(30.0)
        return Meshes([], 0, request.memory.reserve(0))


@pytest.fixture
def queue():
    made = Queue(share=0.75)
    yield made
    made.go.set()
    made.close()


def test_one_client_leaves_places_for_others_and_clients_take_turns(queue: Queue) -> None:
    futures = [read(queue.of("greedy"), b"") for _ in range(6)]
    assert queue.begun.wait(30.0)
    with pytest.raises(MeshError, match="are waiting"):
        read(queue.of("greedy"), b"")
    futures += [read(queue.of(name), b"") for name in ("second", "third")]
    with pytest.raises(MeshError, match="8 requests are waiting"):
        read(queue.of("fourth"), b"")
    futures.append(queue.read_package(SHAPES, Path("package")))
    queue.go.set()
    for future in futures:
        future.result(30.0)
    assert queue.order == ["greedy", "greedy", "second", "third", PACKAGES, *["greedy"] * 4]
    read(queue.of("fourth"), b"").result(30.0)


def test_a_cancelled_request_gives_back_its_place_and_the_room_of_its_zip(
    queue: Queue, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.shared.memory.answers.SMALL", 0)
    mine = queue.of("a")
    running = read(mine, b"", mine.memory.reserve(7))
    assert queue.begun.wait(30.0)
    waiting = [read(mine, b"", mine.memory.reserve(1000)) for _ in range(5)]
    assert queue.memory.held == mine.memory.held == 5007
    for future in waiting:
        queue.cancel(future)
    assert queue.memory.held == 7, "the room is kept exactly as long as the zip"
    waiting = [read(mine, b"") for _ in range(5)]
    queue.go.set()
    running.result(30.0)
    for future in waiting:
        future.result(30.0)
    wait_for(lambda: queue.memory.held == 0)


def test_meshes_that_are_being_read_can_be_cancelled(reader: MeshReader, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.shared.memory.answers.SMALL", 0)
    mine = reader.of("a")
    begun = threading.Event()

    class Asleep(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, command: list[str], **options: Any) -> None:
            super().__init__([sys.executable, "-c", "import time; time.sleep(50)"], **options)
            begun.set()

    with monkeypatch.context() as patch:
        patch.setattr(subprocess, "Popen", Asleep)
        future = read(mine, packed(robot_files()), mine.memory.reserve(1000))
        assert begun.wait(30.0)
        reader.cancel(future)
        with pytest.raises(MeshError):
            future.result(30.0)
    assert read(mine, packed(robot_files())).result().triangles == 24
    wait_for(lambda: reader.memory.held == 0)  # the thread that has read the meshes lets go of them


def test_one_client_may_take_a_share_of_the_memory() -> None:
    half = MeshReader(most=2 * MOST_BYTES, share=0.5)
    one, other = half.of("one"), half.of("other")
    assert half.of("one").memory is one.memory
    held = one.memory.reserve(MOST_BYTES)
    with pytest.raises(MemoryFullError):
        one.memory.reserve(MOST_BYTES // 2)
    more = other.memory.reserve(MOST_BYTES)
    assert half.memory.held == 2 * MOST_BYTES
    third = half.of("third")
    with pytest.raises(MemoryFullError):
        third.memory.reserve(MOST_BYTES)
    assert third.memory.held == 0
    held.release()
    more.release()
    assert half.memory.held == one.memory.held == other.memory.held == 0


def test_meshes_beyond_the_memory_of_the_process_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.shared.memory.answers.SMALL", 0)
    small = MeshReader()
    small.memory._most = 100
    with pytest.raises(MeshError, match="as many as it may"):
        read(small.of("a"), packed(robot_files())).result()
    small.close()


def test_the_process_has_bounds_and_does_not_see_the_token(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KINBOARD_TOKEN", "a secret token")
    script = """
import os, resource
from app.shared.threads.confined import limit_this_process
from app.viewer.meshes.child import MEMORY, SECONDS
limit_this_process(MEMORY, SECONDS)
assert resource.getrlimit(resource.RLIMIT_CPU)[0] == SECONDS
assert not [name for name in os.environ if name.startswith("KINBOARD")]
try:
    bytearray(MEMORY)
except MemoryError:
    print("bounded")
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=readers._environment(),
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "bounded\n", done.stderr
    assert "KINBOARD_TOKEN" in os.environ


def soup() -> trimesh.Trimesh:
    """6000 triangles that are no surface: most edges belong to many, so that they cannot be simplified."""
    rng = np.random.default_rng(1)
    corners = rng.random((400, 3))[rng.integers(0, 400, 18_000)]
    return trimesh.Trimesh(corners, np.arange(18_000).reshape(-1, 3), process=False)


@pytest.mark.full
def test_smooth_meshes_make_room_for_those_that_cannot_be_simplified(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=7)
    for name, mesh in (("soup.stl", soup()), ("ball.stl", ball)):
        (tmp_path / name).write_bytes(mesh.export(file_type="stl"))
    request, solids = asked("soup.stl", 10, tmp_path)
    request["pieces"].append(Piece("ball.stl", 0, request["pieces"][0].pose))
    links, drawn = unpack(answer_to(request, solids), 200_000)
    assert drawn == 60_000 + len(ball.faces)
    triangles = sum(len(surface.faces) for link in links for surface in link.surfaces)
    assert 60_000 < triangles < 1.4 * 80_000


@pytest.mark.full
def test_what_cannot_be_drawn_or_simplified_is_refused(tmp_path: Path) -> None:
    flat = trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False)
    for name, mesh in (("soup.stl", soup()), ("flat.stl", flat)):
        (tmp_path / name).write_bytes(mesh.export(file_type="stl"))
    for name, count, expected in (("soup.stl", 300, "to draw"), ("flat.stl", 1, "area")):
        with pytest.raises(MeshError, match=expected):
            answer_to(*asked(name, count, tmp_path))


def asked(name: str, count: int, folder: Path) -> tuple[dict[str, Any], bytes]:
    """A request for a file that is drawn so often."""
    pose = np.eye(4)[:3].ravel().tolist()
    solids = pack([LinkBody([], np.empty((0, 3), np.float32))])
    request = {"pieces": [Piece(name, 0, pose)] * count, "links": 1, "reach": 1.0, "most": 80_000}
    return {**request, "solids": len(solids), "folder": str(folder)}, solids


def test_an_answer_without_end_is_cut_off(reader: MeshReader, monkeypatch: pytest.MonkeyPatch) -> None:
    class Talkative(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, command: list[str], **options: Any) -> None:
            endless = "import sys\nwhile True: sys.stdout.write('N' * 10000)"
            super().__init__([sys.executable, "-c", endless], **options)

    monkeypatch.setattr(subprocess, "Popen", Talkative)
    with pytest.raises(MeshError, match="too much work"):
        read(reader.of("a"), packed(robot_files())).result()
