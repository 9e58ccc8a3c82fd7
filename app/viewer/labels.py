"""Labels in a visitor's scene: their size follows the text size of the page."""

from __future__ import annotations

import contextlib
from typing import Any
from weakref import WeakKeyDictionary, WeakValueDictionary

import viser

from kin import InputError

TEXT_SIZES = {"Normal": 1.0, "Large": 1.3, "Projector": 1.7}  # as in static/layout.js and static/layout.css


def text_factor(name: object) -> float:
    """The factor of a text size; raises `kin.InputError` for an unknown one."""
    if not isinstance(name, str) or name not in TEXT_SIZES:
        raise InputError("text size", name, "one of " + ", ".join(TEXT_SIZES))
    return TEXT_SIZES[name]


class _Labels:
    """The labels of one scene by name and own size, and the factor for all of them."""

    def __init__(self) -> None:
        self.factor = 1.0
        self.handles: WeakValueDictionary[tuple[str, float], viser.LabelHandle] = WeakValueDictionary()


_scenes: WeakKeyDictionary[viser.SceneApi, _Labels] = WeakKeyDictionary()


def add_label(
    scene: viser.SceneApi, name: str, text: str, *, scale: float = 1.0, **options: Any
) -> viser.LabelHandle:
    """A label of `scale` times the usual size; `options` are those of viser's function of this name.

    With `depth_test`, solids before the label hide it, as they hide what it names. Without, it is always seen: for
    what is drawn inside a body, and for what must not be missed.
    """
    labels = _scenes.setdefault(scene, _Labels())
    handle = scene.add_label(name, text, font_screen_scale=scale * labels.factor, **options)
    labels.handles[name, scale] = handle
    return handle


def size_labels(scene: viser.SceneApi, factor: float) -> None:
    """Show all labels of a scene, present and future ones, at their own sizes times `factor`."""
    labels = _scenes.setdefault(scene, _Labels())
    if factor != labels.factor:
        labels.factor = factor
        for (_, scale), handle in labels.handles.items():
            with contextlib.suppress(RuntimeError):  # it is removed
                handle.font_screen_scale = scale * factor
