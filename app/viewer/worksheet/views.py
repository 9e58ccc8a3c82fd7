"""The printable page of a worksheet."""

from __future__ import annotations

from markupsafe import Markup

from app.exports.worksheet import Formula, Sheet, draw
from app.exports.worksheet.sheet import SUBSCRIPTS
from app.viewer.views.templates import render

EMPTY = [[""] * 4] * 4


def buttons(lesson: bool) -> str:
    """What can be done with the sheet; whether it is that of a `lesson`, or of the arm alone."""
    return render("sheet/buttons", lesson=lesson)


def page_html(sheet: Sheet) -> str:
    """Questions on the first pages; the solutions, if there are any, on pages of their own."""
    given = [(f"A{str(i).translate(SUBSCRIPTS)}", sheet.entries(A)) for i, A in enumerate(sheet.matrices, 1)]
    ends = [(name, sheet.entries(T)) for name, _, T in sheet.ends]
    pose = sheet.entries(sheet.pose)
    empty = [(name, EMPTY) for name, _ in given]
    matrices = {"nothing": given, "table": empty, "pose": given, "configuration": []}[sheet.left]
    return render(
        "sheet/page",
        sheet=sheet,
        picture=Markup(draw(sheet).svg()),
        matrices=[*matrices, *ends],
        pose=EMPTY if sheet.left in ("table", "pose") else pose,
        solved=[*given, *ends],
        solved_pose=pose,
        ends=[f"{name}: {words}" for name, words, _ in sheet.ends],
        formulas=_formulas(sheet, solution=False),
        corrected=_formulas(sheet, solution=True),
    )


def _formulas(sheet: Sheet, solution: bool) -> list[dict[str, object]]:
    chosen: list[Formula] = [f for f in sheet.formulas if f.solution == solution]
    return [{"title": f.title, "formula": Markup(f.mathml)} for f in chosen]
