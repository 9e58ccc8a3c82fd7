"""What a panel shows, as nodes, and the reconciler that keeps viser's controls equal to them.

Nodes are made anew for each update. A node is the successor of the one with the same key in the same folder;
without a key, of the one of the same type and number. A successor changes properties of the control that is there.
A control is replaced only if its unit or its `of` changes. With a new unit, what was typed before must not be read
in that unit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any, TypeVar

import numpy as np
import viser

from app.viewer.declared.fields import Choice, Settings, Spec
from app.viewer.declared.press import Press
from app.viewer.panel import update_html
from app.viewer.panel.fence import Crossings, Fence
from app.viewer.panel.part import add_html
from app.viewer.viser_patches import sent_value, show_value, uuid_of
from kin import InputError, Robot
from kin.units import Units

Event = tuple[Hashable, ...]
Post = Callable[[Hashable, object], None]
S = TypeVar("S", bound=Settings)
V = TypeVar("V")
NO_LABELS: Mapping[str, str] = {}


@dataclass(slots=True, eq=False)
class Html:
    """HTML that `view` makes of `args`; it is called again only when these have changed."""

    view: Callable[..., str]
    args: tuple[Any, ...] = ()
    key: str = ""


@dataclass(slots=True, eq=False)
class Folder:
    """A folder with nodes; without a label only a container."""

    label: str | None
    children: Sequence[Node]
    open: bool = True
    key: str = ""
    visible: bool = True


@dataclass(slots=True, eq=False)
class Control:
    """The control of the field at a path of the settings.

    Attributes:
        label, hint: in place of those of the field.
        spec: what is valid here, in place of the field's own, where it depends on facts: options, limits.
        value: what it shows instead of the setting, if the setting is only what the visitor has asked for.
        of: another one makes a new control, so that late events of the old one are void.
    """

    path: str
    hint: str | None = None
    visible: bool = True
    key: str = ""
    label: str | None = None
    spec: Spec | None = None
    value: Any = None
    of: Hashable = None


@dataclass(slots=True, eq=False)
class Button:
    """A button and its event; with `hold`, also that many events a second while it is held down."""

    label: str
    event: Event
    hint: str | None = None
    hold: float = 0.0
    key: str = ""
    visible: bool = True
    of: Hashable = None


@dataclass(slots=True, eq=False)
class Buttons:
    """A group of buttons, and the events by their labels. Another `of` makes a new group: late events are void.

    `offered` are the labels on show, all if it is None: a click on one that has just gone still counts. Without
    any of them there is no group.
    """

    label: str
    events: Mapping[str, Event]
    hint: str | None = None
    offered: tuple[str, ...] | None = None
    of: Hashable = None
    key: str = ""


@dataclass(slots=True, eq=False)
class Progress:
    """A progress bar, in per cent."""

    value: float
    key: str = ""


@dataclass(slots=True, eq=False)
class Native:
    """What no node describes: `build` makes it once, at the order that it gets; what it returns has `remove`."""

    build: Callable[[float], Any]
    key: str = ""


@dataclass(slots=True, eq=False)
class Docked:
    """Nodes in a panel of their own to the left of the scene, of this width in pixels."""

    label: str
    children: Sequence[Node]
    width: int
    key: str = ""


Node = Html | Folder | Control | Button | Buttons | Progress | Native | Docked


class _DockedPanel:
    """A panel to the left of the scene, and its tab, into which nodes go."""

    def __init__(self, gui: viser.GuiApi, node: Docked, order: float) -> None:
        self.order = order
        self._panel = gui.add_panel()
        self.tab = self._panel.add_tab(node.label)
        self._panel.dock_left()
        self._panel.set_width(node.width)
        self._panel.expand()  # on a phone it would be collapsed at the end of the sheet

    def remove(self) -> None:
        """Close the panel."""
        self._panel.remove()


@dataclass(slots=True, eq=False)
class _Mounted:
    """A control in the page.

    Attributes:
        serial: in its events.
        known: the value of the setting that it shows.
    """

    handle: Any
    identity: Hashable
    order: float
    serial: int
    spec: Spec | None = None
    known: Any = None
    props: dict[str, Any] = field(default_factory=dict)
    args: tuple[Any, ...] = ()
    events: Mapping[str, Event] = field(default_factory=dict)
    children: dict[Hashable, _Mounted] = field(default_factory=dict)


class PanelView:
    """The controls of one feature, in the container that is open when this is made, or in `top` itself.

    Events are posted as ``("at", path, serial, press)`` with a value, and ``("do", event, serial, press)``. There,
    press is the number of the press, or of the last one: in the inbox, no value replaces one of before a press.
    """

    def __init__(
        self, gui: viser.GuiApi, post: Post, fence: Fence, top: viser.GuiFolderHandle | None = None
    ) -> None:
        self._gui, self._post = gui, post
        self._crossings = Crossings[int](fence, self._show_again)  # by serial
        self._top = gui.add_folder(None) if top is None else top  # each one more makes labels narrower
        self._mounted: dict[Hashable, _Mounted] = {}
        self._live: dict[int, _Mounted] = {}
        self._serials = count(1)
        self._presses = 0
        self._labels: Mapping[str, str] = {}

    @property
    def top(self) -> viser.GuiFolderHandle:
        """The folder that holds them."""
        return self._top

    def show(
        self,
        nodes: Sequence[Node],
        settings: Settings,
        robot: Robot,
        units: Units,
        write: bool = False,
        labels: Mapping[str, str] = NO_LABELS,
    ) -> None:
        """Make the panel equal to these nodes.

        Args:
            write: controls whose value was refused show the setting.
            labels: words in place of labels and hints; with others, all controls are made anew.
        """
        self._settings, self._robot, self._units, self._write = settings, robot, units, write
        if labels != self._labels:
            while self._mounted:
                self._drop(self._mounted.popitem()[1])
            self._labels = labels
        self._fill(self._top, nodes, self._mounted)

    def received(self, settings: S, path: str, serial: int, posted: object) -> S | None:
        """The settings with what a control has sent; None: it has been replaced since, by one in other units.

        Its own value is not sent back to it, so that a slider follows its finger; but where it has crossed
        another one, as of a motion (:mod:`app.viewer.panel.fence`).

        Raises:
            InputError: for an invalid value. What was typed stays; a list, which cannot show what is not in it,
                shows the setting again.
        """
        one = self._live.get(serial)
        if one is None or one.spec is None:
            return None
        try:
            found = one.spec.read(one.spec.names or path.rpartition(".")[2], posted, self._robot, self._units)
        except InputError:
            if one.spec.kind == "dropdown":
                one.known = object()
            raise
        one.known = found
        self._crossings.heard(serial)
        return settings.with_value(path, found)

    @property
    def ids(self) -> frozenset[str]:
        """The ids of the controls and buttons."""
        live = self._live.values()
        return frozenset(uuid_of(one.handle) for one in live if one.spec is not None or one.events)

    def is_live(self, serial: object) -> bool:
        """Whether the control with this number is still there; 0: an event of no control."""
        return serial == 0 or serial in self._live

    def remove(self) -> None:
        """Remove everything."""
        self._top.remove()
        self._live.clear()

    def _fill(
        self,
        parent: viser.GuiFolderHandle | viser.GuiTabHandle,
        nodes: Sequence[Node],
        mounted: dict[Hashable, _Mounted],
    ) -> None:
        numbers: dict[type, int] = {}
        gone = set(mounted)
        for order, declared in enumerate(nodes, 1):
            node = self._in_words(declared) if self._labels else declared
            kind = type(node)
            number = numbers[kind] = numbers.get(kind, 0) + 1
            if isinstance(node, Buttons) and node.offered == ():
                continue  # viser shows no group without a button
            name = node.path if isinstance(node, Control) else number
            key: Hashable = (kind, node.key or name)
            gone.discard(key)
            identity = self._identity(node)
            one = mounted.get(key)
            if one is not None and one.identity != identity:
                self._drop(one)
                one = None
            if one is None:
                with parent:
                    one = mounted[key] = self._make(node, identity, float(order))
                self._live[one.serial] = one
            elif one.order != order:
                one.order = one.handle.order = float(order)
            self._update(node, one)
        for key in gone:
            self._drop(mounted.pop(key))

    def _drop(self, one: _Mounted) -> None:
        self._forget(one)
        one.handle.remove()

    def _forget(self, one: _Mounted) -> None:
        self._live.pop(one.serial, None)
        for child in one.children.values():
            self._forget(child)

    def _in_words(self, node: Node) -> Node:
        """A node with its own words in place of its labels."""

        def said(label: str) -> str:
            return self._labels.get(label, label)

        def hinted(hint: str | None) -> str | None:
            return hint and said(hint)

        match node:
            case Folder():
                return replace(node, label=hinted(node.label))
            case Button():
                return replace(node, label=said(node.label), hint=hinted(node.hint))
            case Buttons():
                events = self._all_said(node.events)
                words = dict(zip(node.events, events, strict=True))
                offered = node.offered and tuple(words[label] for label in node.offered if label in words)
                label, hint = said(node.label), hinted(node.hint)
                return replace(node, label=label, hint=hint, events=events, offered=offered)
            case Control():
                spec = self._spec(node)
                label, hint = said(node.label or spec.label), hinted(node.hint or spec.hint)
                if isinstance(spec, Choice):
                    spec = spec.narrowed(self._all_said(spec.offered(self._robot)))
                return replace(node, label=label, hint=hint, spec=spec)
        return node

    def _all_said(self, values: Mapping[str, V]) -> dict[str, V]:
        """Values by other words for their labels; where two of these would be the same, by the labels."""
        said = {self._labels.get(label, label): value for label, value in values.items()}
        return said if len(said) == len(values) else dict(values)

    def _spec(self, node: Control) -> Spec:
        return node.spec or self._settings.spec(node.path)

    def _value(self, node: Control) -> Any:
        return self._settings.value_at(node.path) if node.value is None else node.value

    def _identity(self, node: Node) -> Hashable:
        """A control of another identity is made anew."""
        match node:
            case Control(of=of):
                spec = self._spec(node)
                fixed = spec.fixed(self._robot, self._units)
                return spec.kind, spec.unit(self._units), of, tuple(fixed.items())
            case Buttons(of=of) | Button(of=of):
                return of
        return None

    def _inputs(self, node: Node) -> tuple[Any, ...]:
        """What the properties of a control depend on."""
        match node:
            case Control(label=label, hint=hint, visible=visible, spec=spec):
                return label, hint, visible, spec, self._robot, self._units
            case Button(label=label, hint=hint, visible=visible):
                return label, hint, visible
            case Buttons(label=label, hint=hint, events=events, offered=offered):
                return label, hint, tuple(events) if offered is None else offered
            case Folder(label=label, visible=visible):
                return label, visible
            case Html(args=args):
                return args
        return ()

    def _props(self, node: Node) -> dict[str, Any]:
        match node:
            case Control(hint=hint, visible=visible):
                spec = self._spec(node)
                props = spec.props(self._robot, self._units)
                unit, label = props.pop("unit", ""), node.label or spec.label
                label = label if not unit else f"{label}, {unit}"
                return {"label": label, "hint": hint or spec.hint, "visible": visible, **props}
            case Button(label=label, hint=hint, visible=visible):
                return {"label": label, "hint": hint, "visible": visible}
            case Buttons(label=label, hint=hint, events=events, offered=offered):
                return {"label": label, "hint": hint, "options": tuple(events) if offered is None else offered}
            case Folder(label=label, visible=visible):
                return {"label": label, "visible": visible}
        return {}

    def _make(self, node: Node, identity: Hashable, order: float) -> _Mounted:
        gui, props = self._gui, self._props(node)
        one = _Mounted(None, identity, order, next(self._serials), props=props, args=self._inputs(node))
        match node:
            case Html(view=view, args=args):
                one.handle = add_html(gui, view(*args), order=order)
            case Folder(open=is_open):
                one.handle = gui.add_folder(**props, expand_by_default=is_open, order=order)
            case Control(path=path):
                spec, one.known = self._spec(node), self._value(node)
                shown = spec.shown(one.known, self._robot, self._units)
                fixed = spec.fixed(self._robot, self._units)
                one.handle = getattr(gui, f"add_{spec.kind}")(initial_value=shown, order=order, **props, **fixed)
                self._listen(one.handle, path, one.serial)
            case Button(event=event, hold=hold):
                one.handle = gui.add_button(order=order, **props)
                one.events = {"": event}
                self._listen_button(one.handle, one, hold)
            case Buttons():
                one.handle = gui.add_button_group(order=order, **props)
                self._listen_group(one.handle, one)
            case Progress(value=value):
                one.handle = gui.add_progress_bar(value, order=order)
            case Native(build=build):
                one.handle = build(order)
            case Docked():
                one.handle = _DockedPanel(gui, node, order)
        return one

    def _update(self, node: Node, one: _Mounted) -> None:
        args = self._inputs(node)
        if not same(args, one.args):
            one.args = args
            if isinstance(node, Html):
                update_html(one.handle, node.view(*args))
            else:
                props, before = self._props(node), one.props
                for name, value in props.items():
                    if before[name] != value:
                        setattr(one.handle, name, value)
                one.props = props
        if isinstance(node, Folder):
            self._fill(one.handle, node.children, one.children)
        elif isinstance(node, Docked):
            self._fill(one.handle.tab, node.children, one.children)
        elif isinstance(node, Button):
            one.events = {"": node.event}
        elif isinstance(node, Buttons):
            one.events = node.events
        elif isinstance(node, Progress):
            show_value(one.handle, node.value)
        elif isinstance(node, Control):
            one.spec = spec = self._spec(node)
            value = self._value(node)
            if self._write or value != one.known:
                show_value(one.handle, spec.shown(value, self._robot, self._units))
                self._crossings.sent([one.serial])
                one.known = value

    def _show_again(self, serial: int) -> None:
        one = self._live.get(serial)
        if one is not None and one.spec is not None:
            show_value(one.handle, one.spec.shown(one.known, self._robot, self._units), again=True)

    def _listen(self, handle: Any, path: str, serial: int) -> None:
        async def changed(event: Any) -> None:
            if event.client is not None:
                self._post(("at", path, serial, self._presses), sent_value(event))

        handle.on_update(changed)

    def _press(self, event: Event, serial: int) -> None:
        """Each press has a number, so that no tap is lost."""
        self._presses += 1
        self._post(("do", event, serial, self._presses), None)

    def _listen_group(self, handle: Any, one: _Mounted) -> None:
        async def clicked(event: Any) -> None:
            if event.client is not None and (found := one.events.get(event.target.value)) is not None:
                self._press(found, one.serial)

        handle.on_click(clicked)

    def _listen_button(self, handle: Any, one: _Mounted, hold: float) -> None:
        press = Press()

        # A slow worker skips repeats of one press.
        async def held(found: Any) -> None:
            if found.client is not None and press.held(time.monotonic()):
                self._post(("do", one.events[""], one.serial, -press.number), None)

        async def clicked(found: Any) -> None:
            if found.client is not None and (not hold or press.clicked(time.monotonic())):
                self._press(one.events[""], one.serial)

        if hold:
            handle.on_hold(held, callback_hz=hold)
        handle.on_click(clicked)


def same(a: Collection[Any], b: Collection[Any]) -> bool:
    """Whether arguments are the same: arrays by their values, everything else as it compares."""
    return len(a) == len(b) and all(x is y or _equal(x, y) for x, y in zip(a, b, strict=True))


def _equal(x: Any, y: Any) -> bool:
    if isinstance(x, np.ndarray) or isinstance(y, np.ndarray):
        return isinstance(x, np.ndarray) and isinstance(y, np.ndarray) and np.array_equal(x, y)
    if isinstance(x, list | tuple) and isinstance(y, list | tuple):
        return same(x, y)
    return bool(x == y)
