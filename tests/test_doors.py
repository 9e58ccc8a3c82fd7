"""Every place that parses text, unpacks or decodes it says whose text that is.

What a visitor sends is read by the bounded readers of `kin.parsing`, by pydantic's parser of JSON, which
`app.api.body` calls and which is not looked for here, and by the few modules in `GUARDED`, which bound it
themselves. The others in `TRUSTED` read what the service, its operator or the user of this machine has written.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

PARSERS = {
    *("json.load", "json.loads", "json.JSONDecoder", "tomllib.load", "tomllib.loads", "csv.reader"),
    *(
        "csv.DictReader",
        "zipfile.ZipFile",
        "zlib.decompress",
        "zlib.decompressobj",
        "gzip.decompress",
        "gzip.open",
    ),
    *("bz2.decompress", "lzma.decompress", "expat.ParserCreate", "ElementTree.fromstring", "ElementTree.parse"),
    *("yaml.safe_load", "pickle.load", "pickle.loads", "np.load", "ast.parse", "ast.literal_eval", "eval", "exec"),
    *("base64.b64decode", "base64.urlsafe_b64decode", "urlsafe_b64decode", "b64decode", "Fraction", "Decimal"),
    *("ZstdDecompressor", "LZ4FrameDecompressor", "msgspec.msgpack.Decoder", "msgspec.json.Decoder", "parse_qs"),
}
LAST = {name.rpartition(".")[2] for name in PARSERS}
# Modules that a visitor's text reaches, and what bounds it there.
GUARDED = {
    "kin/parsing.py": "the readers",
    "kin/files/urdf/xml.py": "bytes, elements and depth, while it is parsed",
    "app/classroom/courses/sealing.py": "bytes, while it is unpacked; only what the service has sealed",
    "app/exercises/expressions.py": "characters",
    "app/live/line.py": "64 kB, and read by `app.api.live.messages` before",
    "app/live/recording/files.py": "bytes, while it is unpacked",
    "app/service/web/access.py": "bytes",
    "app/service/web/embedding.py": "bytes of the head of a request",
    "app/service/web/inspection.py": "bytes and depth",
    "app/viewer/meshes/archive.py": "bytes and files before it is unpacked",
    "app/viewer/meshes/child.py": "a process of its own",
    "app/viewer/meshes/loading.py": "a process of its own",
    "app/viewer/session/state.py": "characters, and bytes while it is unpacked",
}
# Modules, or folders, whose text comes from nobody else.
TRUSTED = {
    "app/api/document.py": "a file of ours",
    "app/bench": "a program for developers",
    "app/classroom/lti/platforms.py": "the operator's file",
    "app/classroom/marks.py": "our database",
    "app/classroom/results/gains.py": "our database",
    "app/cli": "files of who runs the command",
    "app/exercises/lesson_text.py": "files of ours",
    "app/exports/formats.py": "it writes",
    "app/live/client/connection.py": "the service to which a program has connected",
    "app/notebook/child.py": "the process that started this one",
    "app/shared/answers/answer.py": "code of ours",
    "app/service/compute": "the service, and its own processes",
    "app/shared/settings.py": "the operator's settings",
    "app/shared/solver_names.py": "a file of ours",
    "app/viewer/courses/feature.py": "a course of our database",
    "app/viewer/lessons/guide/labels.py": "code of ours",
    "app/viewer/lessons/inverse/formulas.py": "code of ours",
    "app/viewer/meshes/library/library.py": "a file of ours",
    "app/viewer/meshes/reader.py": "the process that reads meshes",
    "app/viewer/meshes/surface.py": "the process that reads meshes",
    "app/viewer/own_arm.py": "what it has written itself",
    "app/viewer/room/views.py": "a course of our database",
    "app/viewer/scene/bodies/drawing.py": "a file of ours",
    "app/equations/expression.py": "code of ours",
    "kin/codegen/source.py": "code of ours",
    "kin/kernels": "the folder of compiled kernels",
}


def parsers(source: str) -> Iterator[str]:
    """The parsers that a source calls or passes on."""
    if not any(name in source for name in PARSERS):
        return
    for node in ast.walk(ast.parse(source)):
        last = node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
        if last in LAST and (name := ast.unparse(node)) in PARSERS:
            yield name


def unknown(sources: dict[str, str]) -> set[str]:
    known = (*GUARDED, *TRUSTED)
    return {
        f"{path}: {name}"
        for path, source in sources.items()
        for name in parsers(source)
        if not any(path == each or path.startswith(each + "/") for each in known)
    }


@pytest.fixture(scope="module")
def sources() -> dict[str, str]:
    paths = (path for folder in ("kin", "app") for path in (ROOT / folder).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def test_every_parser_is_known(sources):
    assert unknown(sources) == set()


def test_the_lists_have_no_more_than_there_is(sources):
    assert not GUARDED.keys() & TRUSTED.keys()
    for each in (*GUARDED, *TRUSTED):
        inside = (source for path, source in sources.items() if path == each or path.startswith(each + "/"))
        assert any(name for source in inside for name in parsers(source)), f"{each} parses nothing"


@pytest.mark.parametrize("source", ["import json\njson.loads(x)", "import csv\nf(csv.reader)", "eval(text)"])
def test_a_new_parser_is_found(source):
    assert unknown({"app/viewer/new.py": source, "app/viewer/session/state.py": source})
