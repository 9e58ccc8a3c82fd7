"""Worksheets: an arm at a configuration, with the questions of a lesson, as text, drawing and printable page.

`sheet` has what all formats show, in the reader's units; `drawing` draws the arm with its frames; `latex` and
`tables` (CSV) write files. The printable page is made by the viewer, which has the HTML templates.
"""

from app.exports.worksheet.drawing import Drawing, draw
from app.exports.worksheet.latex import latex
from app.exports.worksheet.sheet import Formula, Left, Part, Question, Row, Sheet
from app.exports.worksheet.tables import csv_text

__all__ = ["Drawing", "Formula", "Left", "Part", "Question", "Row", "Sheet", "csv_text", "draw", "latex"]
