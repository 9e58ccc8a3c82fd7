"""Kinds of exercises. Adding one is one module with a :class:`~app.exercises.contract.Kind` and one row here."""

from __future__ import annotations

from app.exercises.contract import Kind
from app.exercises.kinds.choice import ChoiceKind
from app.exercises.kinds.dh import DHKind
from app.exercises.kinds.find import FindKind
from app.exercises.kinds.frame import FrameKind
from app.exercises.kinds.mistake import MistakeKind
from app.exercises.kinds.number import NumberKind
from app.exercises.kinds.order import OrderKind
from app.exercises.kinds.program import ProgramKind
from app.exercises.kinds.reach import ReachKind
from app.exercises.kinds.singularity import SingularityKind
from app.exercises.kinds.sketch import SketchKind
from app.exercises.kinds.solutions import SolutionsKind
from app.exercises.kinds.sort import SortKind
from app.exercises.kinds.term import TermKind

KINDS: dict[str, type[Kind]] = {
    kind.name: kind
    for kind in (
        NumberKind,
        ChoiceKind,
        DHKind,
        MistakeKind,
        ReachKind,
        FindKind,
        SolutionsKind,
        SingularityKind,
        TermKind,
        FrameKind,
        OrderKind,
        SortKind,
        ProgramKind,
        SketchKind,
    )
}
