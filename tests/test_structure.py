"""Size, shape and vocabulary of the code, checked on the syntax tree of every module.

Each rule is a function that yields the places in a source tree that break it; `test_layering.py` holds who may
import whom. `KNOWN` lists today's exceptions. It has to be exact: an entry without a finding fails as well.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAX_MEMBERS = 20  # modules in a folder
MAX_MODULE = 600  # lines of one idea; two ideas are two modules long before
MAX_FUNCTION = 60  # lines, from `def` to the last one
MAX_PARAMETERS = 9  # of a compiled function
REASON = "Long because"  # begins the sentence of a docstring that says why a function or module is longer
COMPILERS = {"jit", "jit_with_gil", "inlined"}  # decorators of `kin.kernels.compile`
BANNED = re.compile(
    r"\b(calm|dear|told|whoever|wish(?:es|ed)?|who (?:asks|wants|waits))\b"
    r"|\b(stands guard|the least offending|square to)\b",
    re.I,
)

Sources = dict[str, str]  # path relative to the repository → text
FunctionDef = ast.FunctionDef | ast.AsyncFunctionDef


def read_sources(*folders: str) -> Sources:
    paths = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}


@cache
def tree(source: str) -> ast.Module:
    return ast.parse(source)


def functions(sources: Sources) -> Iterator[tuple[str, FunctionDef]]:
    """Every function and method with its place, ``path::name``."""
    for path, source in sources.items():
        for node in ast.walk(tree(source)):
            if isinstance(node, FunctionDef):
                yield f"{path}::{node.name}", node


def crowded_folders(sources: Sources) -> Iterator[str]:
    """Folders with more than `MAX_MEMBERS` modules."""
    sizes = Counter(path.rpartition("/")[0] for path in sources)
    yield from (folder for folder, size in sizes.items() if size > MAX_MEMBERS)


def long_modules(sources: Sources) -> Iterator[str]:
    """Modules of more than `MAX_MODULE` lines whose docstring gives no reason."""
    for path, source in sources.items():
        reason = REASON in (ast.get_docstring(tree(source)) or "")
        if len(source.splitlines()) > MAX_MODULE and not reason:
            yield path


def long_functions(sources: Sources) -> Iterator[str]:
    """Functions of more than `MAX_FUNCTION` lines whose docstring gives no reason."""
    for place, node in functions(sources):
        assert node.end_lineno is not None
        length = node.end_lineno - node.lineno + 1
        if length > MAX_FUNCTION and REASON not in (ast.get_docstring(node) or ""):
            yield place


def long_signatures(sources: Sources) -> Iterator[str]:
    """Compiled functions of more than `MAX_PARAMETERS` parameters: calls mix up their order."""
    for place, node in functions(sources):
        decorators = {ast.unparse(d).partition("(")[0].rpartition(".")[2] for d in node.decorator_list}
        arguments = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
        if decorators & COMPILERS and len(arguments) > MAX_PARAMETERS:
            yield place


def untyped_solvers(sources: Sources) -> Iterator[str]:
    """Modules of `kin/solvers` that name `Any` or call `getattr` or `hasattr`: the contract is typed."""
    for path, source in sources.items():
        names = {node.id for node in ast.walk(tree(source)) if isinstance(node, ast.Name)}
        if path.startswith("kin/solvers/") and names & {"Any", "getattr", "hasattr"}:
            yield path


def cut_sentences(sources: Sources) -> Iterator[str]:
    """Functions that take sentences apart at a colon instead of passing on codes and numbers."""
    for place, function in functions(sources):
        for node in ast.walk(function):
            match node:
                case ast.Call(
                    func=ast.Attribute(attr="partition" | "rpartition" | "split" | "rsplit"),
                    args=[ast.Constant(value=": "), *_],
                ):
                    yield place


def context_variables(sources: Sources) -> Iterator[str]:
    """Modules of `kin` that use a `ContextVar`: what a function returns depends on its arguments alone."""
    yield from (path for path, source in sources.items() if path.startswith("kin/") and "ContextVar" in source)


def own_numbers(sources: Sources) -> Iterator[str]:
    """Numbers of the page not written by `kin.units.general`: they may have e-05, or a hyphen as minus sign."""
    for path, source in sources.items():
        if path.startswith("app/viewer/meshes/"):  # its process starts without the core
            continue
        if path.startswith(("app/viewer/", "app/exercises/")) and re.search(r"\{[^{}]*:\.[1-6]g\}", source):
            yield path


def banned_words(sources: Sources) -> Iterator[str]:
    """Identifiers, comments and docstrings with a word of `BANNED`, as ``path: word``."""
    for path, source in sources.items():
        found = set()
        if BANNED.search(" ".join(words(source).split())):  # parsing each source would take a quarter of a minute
            for text in prose(source):
                found |= {match.group().lower() for match in BANNED.finditer(text)}
        yield from (f"{path}: {word}" for word in sorted(found))


def prose(source: str) -> Iterator[str]:
    """The comments, docstrings and identifiers of a source, identifiers as words."""
    tokens = list(tokenize.generate_tokens(io.StringIO(source).readline))
    yield "\n".join(token.string for token in tokens if token.type == tokenize.COMMENT)
    names = sorted({token.string for token in tokens if token.type == tokenize.NAME})
    yield words("\n".join(names))
    for node in ast.walk(tree(source)):
        if isinstance(node, ast.Module | ast.ClassDef | FunctionDef):
            yield " ".join((ast.get_docstring(node) or "").split())


def words(text: str) -> str:
    """A text with the parts of identifiers as words."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).replace("_", " ")


def import_circles(sources: Sources) -> Iterator[str]:
    """Imports that are part of a circle among the members of a folder, as ``folder: member → member``.

    A member is a module of the folder or a folder within it with all that it holds; imports inside functions and
    under TYPE_CHECKING count. Without a circle at any level there is none between modules anywhere.
    """
    graphs: dict[str, dict[str, set[str]]] = {}
    for path, source in sources.items():
        for imported in imported_paths(source, sources):
            here, there = path.split("/"), imported.split("/")
            level = next((i for i, (a, b) in enumerate(zip(here, there, strict=False)) if a != b), None)
            if level:  # 0: another package; None: itself
                graph = graphs.setdefault("/".join(here[:level]), {})
                graph.setdefault(here[level].removesuffix(".py"), set()).add(there[level].removesuffix(".py"))
    for folder, graph in graphs.items():
        for member, imported in graph.items():
            yield from (f"{folder}: {member} → {other}" for other in imported if member in reachable(graph, other))


def reachable(graph: dict[str, set[str]], start: str) -> set[str]:
    found, open_ = {start}, [start]
    while open_:
        new = graph.get(open_.pop(), set()) - found
        found |= new
        open_ += new
    return found


def imported_paths(source: str, sources: Sources) -> Iterator[str]:
    """The paths of the modules among `sources` that a source imports."""
    for node in ast.walk(tree(source)):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            # `from app.shared import store` imports the module app.shared.store if there is one.
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        for name in names:
            whole, parent = name.replace(".", "/"), name.rpartition(".")[0].replace(".", "/")
            candidates = [f"{whole}.py", f"{whole}/__init__.py"]
            if isinstance(node, ast.ImportFrom):
                candidates += [f"{parent}.py", f"{parent}/__init__.py"]
            yield from [path for path in candidates if path in sources][:1]


# What viser's page consists of, and the browser's functions that are replaced in it.
VISER = re.compile(
    r"\bmantine-|\btabler-|\bdata-dock|\bdata-engine|role=\\?[\"'](?:tab|slider|progressbar|option)|\bGuiUpdate"
    r"|\bMutationObserver\b|\.prototype\b"
)


def viser_elsewhere(sources: Sources) -> Iterator[str]:
    """Scripts that know viser's page or replace the browser's functions: only ``static/viser_page.js`` does."""
    for path, source in sources.items():
        if path != "static/viser_page.js":
            yield from (f"{path}: {match}" for match in sorted(set(VISER.findall(source))))


Rule = Callable[[Sources], Iterator[str]]
SCRIPTS = {f"static/{path.name}": path.read_text(encoding="utf-8") for path in (ROOT / "static").glob("*.js")}
CODE = read_sources("kin", "app", "examples")
EVERYTHING = CODE | read_sources("tests")
RULES: dict[Rule, Sources] = {
    crowded_folders: EVERYTHING,
    long_modules: CODE,
    long_functions: EVERYTHING,
    long_signatures: CODE,
    untyped_solvers: CODE,
    cut_sentences: CODE,
    context_variables: CODE,
    own_numbers: CODE,
    banned_words: EVERYTHING,
    import_circles: CODE,
    viser_elsewhere: SCRIPTS,
}

KNOWN: dict[Rule, set[str]] = {}


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_the_code_keeps_the_rules(rule: Rule):
    found, known = set(rule(RULES[rule])), KNOWN.get(rule, set())
    assert found - known == set(), rule.__doc__
    assert known - found == set(), "no longer true: remove these from KNOWN"


def lines(count: int, head: str = "def f():", docstring: str = "") -> str:
    """A function, or whatever else `head` begins, of `count` lines."""
    body = [f'    """{docstring}"""'] if docstring else []
    return "\n".join([head, *body, *["    pass"] * (count - 1 - len(body))])


TEN = "a, b, c, d, e, f, g, h, i, j"
BREACHES: list[tuple[Rule, Sources, str]] = [
    (crowded_folders, {f"kin/new/m{i}.py": "" for i in range(21)}, "kin/new"),
    (long_modules, {"kin/new.py": "x = 1\n" * 601}, "kin/new.py"),
    (long_functions, {"app/new.py": lines(61)}, "app/new.py::f"),
    (long_functions, {"app/new.py": lines(61, "async def f():", "Long as it has to be.")}, "app/new.py::f"),
    (long_signatures, {"kin/new.py": f"@jit\ndef f({TEN}): ..."}, "kin/new.py::f"),
    (long_signatures, {"kin/new.py": f"@c.inlined(x=1)\ndef f(*, {TEN}): ..."}, "kin/new.py::f"),
    (untyped_solvers, {"kin/solvers/new.py": "x: Any = 1"}, "kin/solvers/new.py"),
    (untyped_solvers, {"kin/solvers/new.py": "y = getattr(x, 'solve')"}, "kin/solvers/new.py"),
    (cut_sentences, {"app/new.py": "def f(text):\n    return text.partition(': ')[0]"}, "app/new.py::f"),
    (context_variables, {"kin/new.py": "from contextvars import ContextVar"}, "kin/new.py"),
    (banned_words, {"kin/new.py": "# What is told of it."}, "kin/new.py: told"),
    (banned_words, {"kin/new.py": "def ik_wishes(): ..."}, "kin/new.py: wishes"),
    (banned_words, {"kin/new.py": "class DearAnswers: ..."}, "kin/new.py: dear"),
    (own_numbers, {"app/viewer/new.py": 'f"{speed:.3g} m/s"'}, "app/viewer/new.py"),
    (viser_elsewhere, {"static/new.js": 'find(".mantine-Slider-root")'}, "static/new.js: mantine-"),
    (viser_elsewhere, {"static/new.js": "find('[role=\"tab\"]')"}, 'static/new.js: role="tab'),
    (viser_elsewhere, {"static/new.js": "Worker.prototype.postMessage = f"}, "static/new.js: .prototype"),
    (viser_elsewhere, {"static/new.js": "new MutationObserver(f)"}, "static/new.js: MutationObserver"),
    (banned_words, {"kin/new.py": '"""Two axes square\nto each other."""'}, "kin/new.py: square to"),
]
CIRCLES: list[tuple[Sources, set[str]]] = [
    ({"kin/a.py": "import kin.b", "kin/b.py": "from kin.a import x"}, {"kin: a → b", "kin: b → a"}),
    (
        {"kin/a.py": "from kin import b", "kin/b.py": "def late():\n    import kin.c", "kin/c.py": "import kin.a"},
        {"kin: a → b", "kin: b → c", "kin: c → a"},
    ),
    (
        {"kin/x/a.py": "from kin.y.b import B", "kin/y/b.py": "", "kin/y/c.py": "if TYPES:\n    import kin.x.a"},
        {"kin: x → y", "kin: y → x"},
    ),
    (
        {"kin/x/__init__.py": "from kin.x.a import A", "kin/x/a.py": "from kin.x import B"},
        {"kin/x: __init__ → a", "kin/x: a → __init__"},
    ),
]


@pytest.mark.parametrize(("rule", "sources", "place"), BREACHES)
def test_the_rules_have_teeth(rule: Rule, sources: Sources, place: str):
    assert list(rule(sources)) == [place]


@pytest.mark.parametrize(("sources", "imports"), CIRCLES)
def test_circles_are_found(sources: Sources, imports: set[str]):
    assert set(import_circles(sources)) == imports


def test_every_rule_is_shown_to_have_teeth():
    assert {rule for rule, *_ in BREACHES} | {import_circles} == set(RULES)


@pytest.mark.parametrize(
    ("rule", "sources"),
    [
        (crowded_folders, {f"kin/new/m{i}.py": "" for i in range(20)}),
        (long_modules, {"kin/new.py": "x = 1\n" * 600}),
        (long_functions, {"app/new.py": lines(60)}),
        (long_functions, {"app/new.py": lines(80, docstring="F. Long because one loop has many scalars.")}),
        (long_signatures, {"kin/new.py": f"def f({TEN}): ..."}),
        (untyped_solvers, {"app/new.py": "x: Any = getattr(y, 'z')"}),
        (cut_sentences, {"app/new.py": "def f(text):\n    return text.partition('=')[0]"}),
        (own_numbers, {"app/viewer/new.py": "f'{general(x, 3)} {y:.3f} {code:.9g}'", "kin/new.py": "f'{x:.3g}'"}),
        (viser_elsewhere, {"static/viser_page.js": "new MutationObserver(f); find('.mantine-Slider-root')"}),
        (viser_elsewhere, {"static/new.js": "viserPage.watch(f); history.replaceState(state)"}),
        (banned_words, {"app/new.py": "text = 'as I told you'; retold = calmness = 1"}),
        (
            import_circles,
            {"kin/a.py": "from kin.b import x", "kin/b.py": "import kin.c", "kin/c.py": "import numpy"},
        ),
    ],
)
def test_what_the_rules_allow_passes(rule: Rule, sources: Sources):
    assert list(rule(sources)) == []


def test_modules_of_tests_have_names_of_their_own():
    """pytest refuses to collect two modules of one name, with all others of that run."""
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


# Numbers that only fall: a change that makes one smaller writes the new one here.
PRIVATE = 203  # uses of others' private names in tests
IMPORTANT = 66  # in style sheets: most override what viser or Mantine writes into the style of an element
# Private fields that features change, by class; none of all others.
FIELDS: dict[str, int] = {}
FEATURE = re.compile(r"(Feature|Lesson)\b")
NOT_PRIVATE = {"_replace", "_asdict", "_fields", "_make", "_repr_html_"}  # of named tuples and IPython


def private_names(sources: Sources) -> Iterator[str]:
    """Uses of private names of another object or module."""
    for path, source in sources.items():
        for node in ast.walk(tree(source)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.ImportFrom) else []
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) not in ("self", "cls"):
                names = [node.attr]
            private = (name for name in names if re.match(r"_(?!_)", name) and name not in NOT_PRIVATE)
            yield from (f"{path}: {name}" for name in private)


@pytest.mark.full
def test_tests_use_fewer_and_fewer_private_names():
    assert len([*private_names(read_sources("tests"))]) <= PRIVATE


def test_private_names_are_found():
    source = "import a\nfrom b import _x, y\na._z = self._own\na.b._c(t._replace(d=1))\na.__doc__"
    assert sorted(private_names({"t.py": source})) == ["t.py: _c", "t.py: _x", "t.py: _z"]


def fields_of_features(sources: Sources) -> Iterator[str]:
    """Private fields that methods of a feature change: what is to be seen follows from its settings and facts.

    What is made when it is built, or when there is another robot, does not count.
    """
    for path, source in sources.items():
        classes = (node for node in ast.walk(tree(source)) if isinstance(node, ast.ClassDef))
        for one in (each for each in classes if any(FEATURE.search(ast.unparse(base)) for base in each.bases)):
            methods = (node for node in one.body if isinstance(node, FunctionDef))
            changing = (each for each in methods if each.name not in ("__init__", "built", "started"))
            stored = (node for method in changing for node in ast.walk(method) if isinstance(node, ast.Attribute))
            names = {
                node.attr
                for node in stored
                if isinstance(node.ctx, ast.Store) and ast.unparse(node.value) == "self"
                if node.attr.startswith("_")
            }
            yield from (f"{path}::{one.name}.{name}" for name in sorted(names))


def test_features_change_no_private_fields():
    sources = {k: v for k, v in read_sources("app/viewer").items() if not k.startswith("app/viewer/declared/")}
    found = Counter(place.rpartition(".")[0].rpartition("::")[2] for place in fields_of_features(sources))
    assert found == FIELDS


def test_private_fields_of_features_are_found():
    source = (
        "class A(DeclaredFeature[B, C], Lesson):\n"
        "    def started(self): self._made = 1\n"
        "    def on_go(self):\n"
        "        self._a, self.b = 1, 2\n"
        "        self._c: int = 3\n"
        "        self._d.e += self._f\n"
        "class D(E):\n"
        "    def on_go(self): self._g = 1\n"
    )
    assert [*fields_of_features({"a.py": source})] == ["a.py::A._a", "a.py::A._c"]


def test_style_sheets_have_fewer_and_fewer_important_declarations():
    sheets = [path.read_text(encoding="utf-8") for path in (ROOT / "static").glob("*.css")]
    assert 0 < sum(sheet.count("!important") for sheet in sheets) <= IMPORTANT
