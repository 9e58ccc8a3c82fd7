"""What static/viser_page.js knows of viser's page is true. A new version of viser fails here, name by name."""

from __future__ import annotations

import re
import time

import pytest
from page import DrawnTab, Tab
from playwright.sync_api import Browser, ConsoleMessage, Route, expect

import kin

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")
TITLES = ["Learn", "Robot", "Workspace", "Program", "View", "Move"]
# Looks for parts, name → selector, after each change of the page, and returns the names that were never found.
WALK = """async ([parts, titles]) => {
  const missing = new Map(Object.entries(parts)), pause = (ms) => new Promise((done) => setTimeout(done, ms));
  const look = () => {
    for (const [name, selector] of missing) if (document.querySelector(selector)) missing.delete(name);
  };
  for (const title of titles) {
    if (!viserPage.openTab(title)) throw new Error(`viser's page has no tab ${title}`);
    for (let k = 0; k < 100 && !viserPage.openTitles().includes(title); k++) await pause(50);
    if (!viserPage.openTitles().includes(title)) throw new Error(`openTab("${title}") opens no tab`);
    for (let k = 0; k < 10 && missing.size; k++) { look(); await pause(50); }
  }
  return [...missing.keys()];
}"""


def missing(tab: Tab, parts: dict[str, str]) -> dict[str, str]:
    """The parts that are in none of the tabs of the panel: name → selector."""
    return {name: parts[name] for name in tab.page.evaluate(WALK, [parts, TITLES])}


def test_viser_has_every_part_of_the_table(desktop: Tab, phone: Tab) -> None:
    parts: dict[str, str] = desktop.page.evaluate("viserPage.parts")
    assert len(parts) > 15
    nowhere = missing(desktop, parts)
    assert nowhere == {}, "viser's page no longer has these parts of static/viser_page.js"
    docked = {name for name in parts if name.startswith("region")}
    on_phone = missing(phone, parts)
    assert set(on_phone) == docked, "a phone's page lacks the docked panel, and nothing else"


def test_a_part_that_viser_lacks_is_named(desktop: Tab) -> None:
    parts = {"tab": '[role="tab"]', "track": ".mantine-Slider-rail"}
    assert missing(desktop, parts) == {"track": ".mantine-Slider-rail"}


def test_viser_calls_every_hook(tab: Tab) -> None:
    tab.type_number("1 rotating base", "12.5")
    tab.page.wait_for_function("Object.values(viserPage.hooks).every((count) => count > 0)", timeout=10_000)


def test_the_functions_find_and_move_viser_s_controls(tab: Tab, phone: Tab) -> None:
    page = tab.page
    lines = """[...document.querySelectorAll("[data-kb-line] > [id]")].map(({ id }) => {
        const thumb = viserPage.thumbOf(id);
        return [thumb?.role, viserPage.fieldOf(id)?.tagName, viserPage.labelOf(thumb) !== ""];
    })"""
    found = page.evaluate(lines)
    assert len(found) > 4
    assert all(line == ["slider", "INPUT", True] for line in found)
    width = page.evaluate("viserPage.region().node.offsetWidth")
    page.evaluate("viserPage.widen(40)")
    page.wait_for_function(f"Math.abs(viserPage.region().node.offsetWidth - {width + 40}) < 2")
    page.evaluate("viserPage.widen(-40)")
    assert phone.page.evaluate("viserPage.sheetOf(document.querySelector('[data-status]')).head.tagName") == "DIV"
    expect(phone.page.locator("[data-kb-head]")).to_have_count(1)


def test_scripts_share_one_observer_whose_watchers_do_not_stop_each_other(desktop: Tab) -> None:
    seen = desktop.page.evaluate(
        """async () => {
          const seen = [], kept = window.reportError;
          let over = false; // watchers stay: after the test these do nothing
          window.reportError = (error) => seen.push(error.message);
          viserPage.watch(() => { if (!over) throw new Error("first"); });
          viserPage.watch(() => { if (!over) seen.push("second"); });
          viserPage.watch(() => { if (!over) seen.push("late"); }, { delay: 20 });
          viserPage.watch(() => { if (!over) seen.push("text"); }, { on: ["characterData"] });
          const node = document.createElement("i");
          document.body.append(node);
          node.remove();
          await new Promise((done) => setTimeout(done, 200));
          over = true;
          window.reportError = kept;
          return seen;
        }"""
    )
    assert seen.index("first") < seen.index("second") < seen.index("late")
    with pytest.raises(Exception, match="data-other is not observed"):
        desktop.page.evaluate("viserPage.watch(() => {}, { on: ['data-other'] })")


# Messages for one frame, as a slow page has them: an update of a component, and then its removal. The first of
# them is not of the panel alone, so that viser waits for the frame.
REMOVED_UNSEEN = """async () => {
  const uuid = "kb-removed";
  const tell = (...messages) => {
    kbWorker.dispatchEvent(new MessageEvent("message", { data: { type: "message_batch", messages } }));
  };
  const frame = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const shown = () => document.body.textContent.includes("kb-removed-text");
  const update = { type: "GuiUpdateMessage", uuid, updates: { content: "<p>another text</p>" } };
  const props = { order: 1e6, content: "<p>kb-removed-text</p>", visible: true };
  tell({ type: "GuiHtmlMessage", uuid, container_uuid: "root", props });
  for (let k = 0; k < 100 && !shown(); k++) await frame();
  if (!shown()) throw new Error("the component does not come");
  tell({ type: "GuiFormSubmitMessage", uuid }, update);
  tell({ type: "GuiRemoveMessage", uuid });
  for (let k = 0; k < 100 && shown(); k++) await frame();
  if (shown()) throw new Error("the component does not go");
  for (let k = 0; k < 5; k++) await frame();
}"""
KEEP_WORKER = """
{
  const { postMessage } = Worker.prototype;
  Worker.prototype.postMessage = function (...sent) {
    window.kbWorker = this;
    return postMessage.apply(this, sent);
  };
}
"""


class WorkerTab(Tab):
    """A tab whose connection can be spoken for."""

    scripts = Tab.scripts + KEEP_WORKER


@pytest.mark.full
def test_updates_of_a_component_that_is_removed_before_the_next_frame_are_dropped(
    browser: Browser, address: str
) -> None:
    tab = WorkerTab(browser, address, 1280, 720)
    tab.page.evaluate(REMOVED_UNSEEN)
    tab.close()  # fails with what the console says


# Within one task of the page, as where it is busy and several clicks wait: no timer of viser's ends in between.
AT_ONCE = """async (acts) => {
  const thumb = document.querySelector("[role=slider][aria-label^='1 rotating base']");
  const event = (key) => new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true });
  const locks = [...document.querySelectorAll("[role=group][aria-label=Locked] button")];
  for (const act of acts) {
    if (act === "undo") document.querySelector("[data-send=undo]").click();
    else if (act === "right") thumb.dispatchEvent(event("ArrowRight"));
    else locks[act].click();
    for (let k = 0; k < 20; k++) await null; // React draws
  }
  for (const end = performance.now() + 400; performance.now() < end;); // a busy page is late for all of its timers
}"""


def test_controls_pressed_within_one_moment_are_all_heard(tab: Tab) -> None:
    tab.page.evaluate(AT_ONCE, [0, 1, 2, 3])
    expect(tab.status).to_contain_text("Joints 1, 2, 3, 4 locked")
    tab.page.get_by_role("button", name="Unlock all").click()
    expect(tab.status).to_contain_text("No joint is locked")


def test_a_slider_that_is_pressed_and_not_moved_shows_afterwards_what_came_meanwhile(tab: Tab) -> None:
    page, name = tab.page, "1 rotating base"
    thumb = tab.row(name).get_by_role("slider").first
    home = thumb.get_attribute("aria-valuenow")
    assert home is not None
    tab.type_number(name, "50")
    tab.wait_for_link(PIONEER, 0, 50)
    page.evaluate("channel.send('released')")
    tab.rest()
    # The mouse would also move it by a part of its step.
    thumb.evaluate("node => node.dispatchEvent(new PointerEvent('pointerdown', { bubbles: true }))")
    page.get_by_role("button", name="Home").evaluate("button => button.click()")
    tab.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3], within=0.06)
    tab.rest()
    expect(thumb).to_have_attribute("aria-valuenow", "50")
    thumb.evaluate("node => node.dispatchEvent(new PointerEvent('pointerup', { bubbles: true }))")
    expect(thumb).to_have_attribute("aria-valuenow", home)


def test_undo_is_not_passed_by_the_slider_that_was_moved_before_it(tab: Tab) -> None:
    field = tab.row("1 rotating base").locator("input:visible").last
    tab.page.evaluate(AT_ONCE, ["right", "right", "right"])
    tab.wait_for_link(PIONEER, 0, 93)
    expect(field).to_have_value("93")
    tab.type_number("1 rotating base", "120")
    tab.wait_for_link(PIONEER, 0, 120)
    tab.page.evaluate(AT_ONCE, ["right", "right", "right", "undo"])
    expect(tab.page.locator("[data-send=redo]")).to_have_attribute("title", re.compile("Redo: Joint 1"))
    tab.rest()
    expect(field).to_have_value("120")
    expect(tab.page.locator("[data-send=redo]")).to_have_attribute("title", re.compile("Redo: Joint 1"))


# What the programs that draw labels have for kbDark.
SHADES = """() => {
  const gl = document.querySelector("canvas[data-engine]").getContext("webgl2");
  return labelPrograms.map((program) => gl.getUniform(program, gl.getUniformLocation(program, "kbDark")));
}"""
# The shaders of labels, from viser's page: collected as they are linked.
COLLECT = """
{
  window.labelPrograms = [];
  const { linkProgram } = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.linkProgram = function (program) {
    linkProgram.call(this, program);
    if (this.getUniformLocation(program, "kbDark")) labelPrograms.push(program);
  };
}
"""


class CollectingTab(DrawnTab):
    """A tab that keeps the shaders of its labels."""

    scripts = DrawnTab.scripts + COLLECT


def test_labels_of_the_scene_follow_the_colours_of_the_page(browser: Browser, address: str) -> None:
    tab = CollectingTab(browser, address, 900, 600)
    page = tab.page
    page.wait_for_function("window.labelPrograms?.length >= 2", timeout=30_000)
    assert not any(page.evaluate(SHADES))
    tab.set_dark(True)
    assert all(page.evaluate(SHADES)), "letters and boxes are drawn in the dark colours"
    tab.set_dark(False)
    assert not any(page.evaluate(SHADES))
    tab.close()


# Another version of viser, which lacks a hook: what static/viser_page.js says of it → what takes it away.
WITHOUT_STATE = """
Object.defineProperty(window, "__viserMutable", { get: () => undefined, set: () => {}, configurable: true });
"""
WITHOUT_ONE = """
{
  let viewer;
  const set = (given) => {
    viewer = new Proxy(given, { get: (all, name) => (name === "%s" ? undefined : all[name]) });
  };
  Object.defineProperty(window, "__viserMutable", { get: () => viewer, set, configurable: true });
}
"""
TAKEN = {
    "__viserMutable.nodeRefFromName": WITHOUT_STATE,
    "__viserMutable.messageQueue": WITHOUT_ONE % "messageQueue",
    "__viserMutable.requestRender": WITHOUT_ONE % "requestRender",
    "__viserMutable.sendMessage": WITHOUT_ONE % "sendMessage",
}


SLOW_TO_UNPACK = """
const compile = WebAssembly.instantiate;
WebAssembly.instantiate = async (...given) => {
  await new Promise((done) => setTimeout(done, 700));
  return compile(...given);
};
"""


def test_this_version_of_viser_lacks_nothing(desktop: Tab) -> None:
    assert desktop.page.evaluate("viserPage.lacks()") == []
    expect(desktop.page.locator("#kb-lacks")).to_have_count(0)


def test_scripts_that_come_late_still_run_before_viser_s(browser: Browser, address: str) -> None:
    """viser's script unpacks itself and starts once the page is read, with whatever address the page has then."""

    class SlowToUnpack(Tab):
        scripts = Tab.scripts + SLOW_TO_UNPACK

    def late(route: Route) -> None:
        time.sleep(1.5)
        route.continue_()

    tab = SlowToUnpack(browser, address, 1280, 720)
    tab.open("Program")
    tab.page.wait_for_function("location.hash.includes('tab=Program')")
    tab.page.route("**/static/channel.js", late)
    tab.page.reload()
    expect(tab.page.get_by_role("tab", name="Program", exact=True)).to_have_attribute("aria-selected", "true")
    assert tab.page.evaluate("viserPage.lacks()") == []
    tab.close()


@pytest.mark.full
@pytest.mark.parametrize("hook", TAKEN)
def test_a_page_without_a_hook_names_it_and_moves_the_arm_by_slider_and_gizmo(
    browser: Browser, address: str, hook: str
) -> None:
    class Without(Tab):
        scripts = Tab.scripts + TAKEN[hook]

        def listen(self, message: ConsoleMessage) -> None:
            if "This version of viser lacks" not in message.text:
                super().listen(message)

    tab = Without(browser, address, 1280, 720)
    note = tab.page.locator("#kb-lacks")
    expect(note).to_contain_text(f"This version of viser lacks {hook}")
    note.get_by_role("button", name="Close").click()
    expect(note).to_have_count(0)
    tab.show(PIONEER)
    q = PIONEER.q_home.copy()
    tab.drag_arrow(PIONEER, kin.fk(PIONEER, q), axis=2, lengths=0.5)
    expect(tab.page.locator("[data-send=undo]")).to_have_attribute("title", re.compile("Drag of the target"))
    tab.type_number("1 rotating base", "20")
    tab.wait_for_link(PIONEER, 0, 20)
    tab.close()


class LabelsTab(DrawnTab):
    """A tab that compares where each label is drawn with where it belongs, in every frame.

    viser writes the places of all labels into a texture of 4096 pixels, and sends it while it draws a frame.
    By then all nodes are where they are drawn. `strayed` has for each frame: the labels, and how far the worst
    is off (m).
    """

    scripts = (
        DrawnTab.scripts
        + """
{
  window.strayed = [];
  const gl = WebGL2RenderingContext.prototype;
  const look = (data) => {
    const viewer = window.__viserMutable;
    if (!viewer) return;
    const { nodeRefFromName: nodes, nodePoseData: poses } = viewer;
    const drawn = [];
    for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 0) drawn.push([data[i], data[i + 1], data[i + 2]]);
    const off = [];
    for (const name of Object.keys(nodes)) {
      const { message, effectiveVisibility } = window.__viserSceneTree.getState()[name] ?? {};
      const parent = nodes[name.slice(0, name.lastIndexOf("/"))];
      if (message?.type !== "LabelMessage" || !effectiveVisibility || !parent) continue;
      const at = parent.position.clone().set(...(poses[name]?.position ?? [0, 0, 0]));
      at.applyMatrix4(parent.matrixWorld);
      off.push(Math.min(...drawn.map(([x, y, z]) => Math.hypot(at.x - x, at.y - y, at.z - z))));
    }
    if (drawn.length) strayed.push([off.length, Math.max(...off)]);
  };
  for (const name of ["texSubImage2D", "texImage2D"]) {
    const send = gl[name];
    gl[name] = function (...what) {
      const data = what.find((each) => each instanceof Float32Array);
      if (data?.length === 4 * 4096) look(data);
      return send.apply(this, what);
    };
  }
}
"""
    )


def test_labels_are_drawn_where_they_belong_while_the_arm_moves_and_another_comes(
    browser: Browser, address: str
) -> None:
    tab = LabelsTab(browser, address, 900, 600)
    frames = "count => strayed.length >= count"
    tab.open("View")
    tab.check("Link frames")
    tab.open("Move")
    tab.page.wait_for_function("strayed.some(([labels]) => labels > 6)")  # of each row, and at the scale bar
    for degrees in (20, 40, 60, 80):
        seen = tab.page.evaluate("strayed.length")
        tab.type_number("1 rotating base", str(degrees))
        tab.page.wait_for_function(frames, arg=seen + 2)
    tab.select(kin.get_robot("ur5"))
    tab.page.wait_for_function(frames, arg=tab.page.evaluate("strayed.length") + 2)
    strayed = tab.page.evaluate("strayed")
    assert max(off for _, off in strayed) < 1e-5, strayed
    tab.close()


RESIZED = """async () => {
  const viewer = window.__viserMutable, draw = viewer.requestRender;
  let asked = 0;
  viewer.requestRender = () => { asked++; draw(); };
  // As viser does where it draws slowly: the picture is empty now.
  document.querySelector("canvas[data-engine]").width -= 1;
  await Promise.resolve();
  viewer.requestRender = draw;
  return asked;
}"""


@pytest.mark.full
def test_a_picture_of_another_resolution_is_drawn_at_once(desktop: Tab) -> None:
    assert desktop.page.evaluate(RESIZED) >= 1


@pytest.mark.full
def test_typing_into_a_menu_replaces_the_name_that_is_chosen(desktop: Tab) -> None:
    page, field = desktop.page, desktop.row("Robot").locator("input:visible").first
    chosen = field.input_value()
    field.click()
    page.keyboard.type("UR5")
    expect(field).to_have_value("UR5")
    shown = page.locator("[data-combobox-option]:visible")
    expect(shown.filter(has_text="UR5").first).to_be_visible()
    expect(shown.filter(has_text="Panda")).to_have_count(0)
    page.keyboard.press("Escape")
    field.blur()
    expect(field).to_have_value(chosen)
