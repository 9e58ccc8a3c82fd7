"""The lessons, by the keys that links, exercise files and course files use. This is the only list of them.

Adding one is a row here and a folder of this name in `app/viewer/lessons/`.
"""

from __future__ import annotations

from typing import Final

# In the order of a course.
LESSONS: Final = (
    "rotations",
    "dh",
    "screws",
    "equations",
    "inverse",
    "postures",
    "numeric",
    "redundancy",
    "velocity",
    "trajectories",
)

ENGLISH: Final = "en"
_LANGUAGES = (
    "en English, bg Български, cs Čeština, da Dansk, de Deutsch, el Ελληνικά, es Español, et Eesti, fi Suomi, "
    "fr Français, hi हिन्दी, hr Hrvatski, hu Magyar, it Italiano, ja 日本語, ko 한국어, lt Lietuvių, lv Latviešu, "
    "nl Nederlands, no Norsk, pl Polski, pt Português, ro Română, sk Slovenčina, sl Slovenščina, sr Српски, "
    "sv Svenska, tr Türkçe, uk Українська, vi Tiếng Việt, zh 中文"
)
# Languages that files may translate lessons into: their own names, by their codes of ISO 639-1.
LANGUAGES: Final[dict[str, str]] = dict(each.split(" ", 1) for each in _LANGUAGES.split(", "))
