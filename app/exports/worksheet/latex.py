"""A worksheet as a LaTeX document, which pdfLaTeX compiles: questions with room to answer, then the solutions."""

from __future__ import annotations

from itertools import count

from app.exports.worksheet.drawing import draw
from app.exports.worksheet.sheet import Question, Sheet
from app.exports.worksheet.words import to_latex
from kin.transforms import Array

HEAD = r"""\documentclass[11pt,a4paper]{article}
\usepackage[T1]{fontenc}
\usepackage[margin=2.2cm]{geometry}
\usepackage{amsmath,amssymb,array,tikz}
\setlength{\parindent}{0pt}
\setlength{\parskip}{6pt}
\interlinepenalty=10000 % no page ends inside a paragraph
\renewcommand{\arraystretch}{1.15}
\newenvironment{together}{\begin{minipage}{\textwidth}\setlength{\parskip}{6pt}}{\end{minipage}\par\medskip}
\begin{document}
"""
LINES = 3  # room for an answer


def latex(sheet: Sheet) -> str:
    """The document."""
    title = to_latex(sheet.title)
    out = [
        HEAD + rf"{{\Large\bfseries {title}}}\hfill Name: \rule{{5cm}}{{0.4pt}}",
        rf"{to_latex(sheet.robot.name)}, {sheet.robot.convention} DH convention.",
    ]
    if sheet.goal:
        out.append(rf"\textbf{{Goal:}} {to_latex(sheet.goal)}")
    out += [r"\begin{center}", draw(sheet).tikz(), r"\end{center}"]
    values = ", ".join(f"{to_latex(name)} = {to_latex(value)}" for name, value in sheet.values)
    out += ["The joint values are to be found." if sheet.left == "configuration" else f"Joints: {values}."]
    out.append(_table(sheet, sheet.left == "table"))
    if sheet.left in ("nothing", "pose"):
        out.append(_matrices(sheet, sheet.left == "pose"))
    elif sheet.left == "configuration":
        out.append(f"Lengths in {sheet.units.lengths.name}.\n\\[T = {_matrix(sheet, sheet.pose)}\\]")
    out += [_formula(f.title, f.latex) for f in sheet.formulas if not f.solution]
    numbers = count(1)
    for part in sheet.parts:
        out.append(rf"\subsection*{{{to_latex(part.title)}}}")
        if part.text:
            out.append(to_latex(part.text))
        out += [_question(next(numbers), question) for question in part.questions]
    if sheet.has_solutions:
        out += [r"\newpage", rf"{{\Large\bfseries {title}: solutions}}"]
        if sheet.left == "configuration":
            out.append(f"Joints: {values}.")
        if sheet.left != "nothing":
            out += [_table(sheet, False), _matrices(sheet, False)]
        out += [_formula(f.title, f.latex) for f in sheet.formulas if f.solution]
        for number, question in enumerate(sheet.questions, 1):
            out.append(rf"\textbf{{{number}.}} {to_latex(question.solution)}")
    return "\n\n".join([*out, r"\end{document}"]) + "\n"


def _question(number: int, question: Question) -> str:
    """A question with room to answer, not divided between two pages."""
    out = [r"\begin{together}", rf"\textbf{{{number}.}} {to_latex(question.prompt)}"]
    if question.options:
        out += [rf"$\square$ {to_latex(option)}" for option in question.options]
    else:
        out += [r"\rule{0pt}{8mm}\dotfill"] * (LINES - 1)
        out.append(rf"\rule{{0pt}}{{8mm}}Answer: \rule{{4cm}}{{0.4pt}} {to_latex(question.unit)}")
    return "\n\n".join([*out, r"\end{together}"])


def _table(sheet: Sheet, blank: bool) -> str:
    heads = " & ".join(["row", *map(to_latex, sheet.heads), "limits"])
    lines = [r"\begin{tabular}{|r|c|c|c|c|c|}", r"\hline", rf"{heads} \\ \hline"]
    for row in sheet.rows:
        cells = ["\\rule{0pt}{6mm}"] + [""] * 3 if blank else [to_latex(cell) for cell in row.cells]
        lines.append(" & ".join([str(row.number), *cells, to_latex(row.limits)]) + r" \\ \hline")
    return "\n".join([*lines, r"\end{tabular}"])


def _matrices(sheet: Sheet, blank: bool) -> str:
    note = f"Lengths in {sheet.units.lengths.name}."
    named = [(f"A_{{{i}}}", A) for i, A in enumerate(sheet.matrices, 1)]
    named += [(name, T) for name, _, T in sheet.ends]
    parts = [note, *(rf"\[{name} = {_matrix(sheet, A)}\]" for name, A in named)]
    product = sheet.product
    for digit, index in zip("0123456789", "₀₁₂₃₄₅₆₇₈₉", strict=True):
        product = product.replace(index, digit)
    product = " ".join(f"A_{{{name[1:]}}}" if name[0] == "A" else name for name in product.split())
    pose = r"\rule{0pt}{16mm}" if blank else _matrix(sheet, sheet.pose)
    return "\n".join([*parts, rf"\[T = {product} = {pose}\]"])


def _matrix(sheet: Sheet, T: Array) -> str:
    rows = r" \\ ".join(" & ".join(row) for row in sheet.entries(T)).replace("−", "-")
    return rf"\begin{{bmatrix}} {rows} \end{{bmatrix}}"


def _formula(title: str, formula: str) -> str:
    return rf"{to_latex(title)}: $\displaystyle {formula}$"
