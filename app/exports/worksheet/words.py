"""Text of the page as LaTeX: Greek letters, indices and signs become commands, and nothing is left to compile."""

from __future__ import annotations

import re
import unicodedata

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "_": r"\_",
    "%": r"\%",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
}
_MATH = {
    "−": "-",
    "×": r"\times",
    "·": r"\cdot",
    "⋅": r"\cdot",
    "°": r"^\circ",
    "±": r"\pm",
    "√": r"\surd",
    "≤": r"\le",
    "≥": r"\ge",
    "≠": r"\ne",
    "≈": r"\approx",
    "→": r"\to",
    "∞": r"\infty",
    "′": "'",
    "∈": r"\in",
    "⊥": r"\perp",
    "∥": r"\parallel",
    "∑": r"\sum",
    "∂": r"\partial",
    "∠": r"\angle",
    "½": r"\frac12",
}
_TEXT = {
    "…": r"\dots{}",
    "–": "--",
    "—": "---",
    "’": "'",
    "‘": "`",
    "“": "``",
    "”": "''",
    "\u00a0": "~",
    "\u202f": r"\,",
    "\u2009": r"\,",
    "✓": "",
    "✕": "",
    "ü": r"\"u",
    "ö": r"\"o",
    "ä": r"\"a",
}
_GREEK = {  # letters that LaTeX has commands for; others look like Latin ones, or have accents
    "SMALL": {
        *("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu"),
        *("nu", "xi", "pi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega"),
    },
    "CAPITAL": {
        *("gamma", "delta", "theta", "lambda", "xi", "pi", "sigma", "upsilon", "phi", "psi", "omega"),
    },
}
_INDICES = "₀₁₂₃₄₅₆₇₈₉ᵢₙ₋₊", "0123456789in-+"
_EXPONENTS = "⁰¹²³⁴⁵⁶⁷⁸⁹ᵀ⁻⁺", "0123456789T-+"
_RAISED = re.compile(f"([{_INDICES[0]}]+|[{_EXPONENTS[0]}]+)")
_PLAIN = str.maketrans(_INDICES[0] + _EXPONENTS[0], _INDICES[1] + _EXPONENTS[1])


def to_latex(text: str) -> str:
    """A sentence for a LaTeX document. Characters that LaTeX knows by itself stay."""
    text = unicodedata.normalize("NFC", text)
    out = []
    for piece in _RAISED.split(text):
        if _RAISED.fullmatch(piece):
            out.append(f"${'_' if piece[0] in _INDICES[0] else '^'}{{{piece.translate(_PLAIN)}}}$")
            continue
        for k, character in enumerate(piece):
            dotted = piece[k + 1 : k + 2] == "\u0307"
            out.append(_dot(character) if dotted else _one(character))
    return "".join(out)


def _dot(character: str) -> str:
    inside = _one(character).strip("$")
    return rf"$\dot{{{inside}}}$"


def _one(character: str) -> str:
    if character == "\u0307":
        return ""
    if character in _SPECIAL:
        return _SPECIAL[character]
    if character in _TEXT:
        return _TEXT[character]
    if character in _MATH:
        return f"${_MATH[character]}$"
    name = unicodedata.name(character, "")
    greek = re.fullmatch("GREEK (SMALL|CAPITAL) LETTER (FINAL )?([A-Z]+)", name)
    if greek is not None and (letter := greek[3].lower().replace("lamda", "lambda")) in _GREEK[greek[1]]:
        return f"$\\{letter.capitalize() if greek[1] == 'CAPITAL' else letter}$"
    raised = re.fullmatch("<(super|sub)> ([0-9A-F]+)", unicodedata.decomposition(character))
    if raised is not None:
        return f"${'^' if raised[1] == 'super' else '_'}{{{chr(int(raised[2], 16))}}}$"
    if "WITH DOT ABOVE" in name:
        return rf"$\dot{{{unicodedata.normalize('NFD', character)[0]}}}$"
    return character
