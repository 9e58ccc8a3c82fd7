"use strict";
// The only script that knows viser's page: how its parts are found (PARTS), what viser calls in the browser (HOOKS), and
// what is mended in its controls. It is loaded first, before viser's own script; the other scripts ask `viserPage`, whose
// functions are described at its end. The styles of viser's parts are in static/viewer.css and static/layout.css.
//
// tests/e2e/test_viser_page.py fails with the name of each part and hook that viser's page no longer has.
const viserPage = (() => {
  // Selectors of viser's parts. Words of ours are in them only where viser gives a part no name.
  const PARTS = {
    page: "#root", // all that viser draws
    tab: '[role="tab"]',
    openTab: '[role="tab"][aria-selected="true"]',
    scene: "canvas[data-engine]",
    scrollArea: ".mantine-ScrollArea-viewport", // the scrolling part of the panel
    contents: ".mantine-ScrollArea-viewport > div > div", // what it scrolls
    paper: ".mantine-Paper-root", // boxes: a phone's sheet, a folder
    folderHead: ".mantine-Paper-root > .mantine-Paper-root:has(> .tabler-icon-chevron-up, > .tabler-icon-chevron-down)",
    region: "[data-dock-region]", // the docked panel
    regionEdge: "[data-dock-region-resize]",
    regionHandle: "[data-dock-region-resize] > :first-child", // takes the pointer
    line: ".mantine-Flex-root", // a control with its label
    label: "label[for]",
    button: "button.mantine-Button-root",
    slider: ".mantine-Slider-root",
    thumb: '[role="slider"]',
    track: ".mantine-Slider-track",
    progress: '[role="progressbar"]',
    menu: "input.mantine-Select-input", // whose options are searched by typing
    settings: "button .tabler-icon-adjustments", // viser's own settings
    commands: "button .tabler-icon-list-search",
    icon: "svg.tabler-icon, svg[data-combobox-chevron]",
  };
  // What viser calls, and how often it has since this page was loaded.
  const HOOKS = {
    reportCamera: 0, hear: 0, shadeLabel: 0, findParent: 0,
  };

  // WebKit on Linux names the locale C as a language. viser's script would end there: no Intl knows it.
  const known = (tag) => { try { return Intl.getCanonicalLocales(tag).length > 0; } catch { return false; } };
  if (!known(navigator.language)) {
    const languages = Object.freeze([...navigator.languages.filter(known), "en"]);
    Object.defineProperty(Navigator.prototype, "languages", { get: () => languages });
    Object.defineProperty(Navigator.prototype, "language", { get: () => languages[0] });
  }

  const { all, closest } = dom;
  const textOf = (node) => node.textContent.trim();

  // Changes of the page: one observer for all scripts.

  const VALUE = "aria-valuenow"; // of a slider's thumb
  const COLOURS = "data-mantine-color-scheme"; // of the page
  const ATTRIBUTES = [VALUE, COLOURS, "aria-hidden", "disabled", "open", "data-time", "data-playing", "data-at", "data-duration"];
  const watchers = [];
  const valueWatchers = new WeakMap(); // thumb → what to call

  function watch(act, { on = ["childList"], delay = 0 } = {}) {
    const unknown = on.filter((kind) => !["childList", "characterData", ...ATTRIBUTES].includes(kind));
    if (unknown.length) throw new TypeError(`viserPage.watch: ${unknown} is not observed`);
    let waiting = 0;
    const later = () => { waiting ||= setTimeout(() => { waiting = 0; act(); }, delay); };
    watchers.push({ on, act: delay ? later : act });
  }

  function dispatch(records) {
    const kinds = new Set();
    const acts = new Set();
    for (const { type: kind, attributeName, target } of records) {
      kinds.add(attributeName ?? kind);
      const act = attributeName === VALUE && valueWatchers.get(target);
      if (act) acts.add(act);
    }
    for (const { on, act } of watchers) if (on.some((kind) => kinds.has(kind))) acts.add(act);
    for (const act of acts) {
      try { act(); } catch (error) { reportError(error); } // the others are called all the same
    }
  }
  /** The page was changed in a way that is not observed, as by other values of attributes. */
  const noteChange = () => dispatch([{ type: "childList" }]);
  const OBSERVED = { subtree: true, childList: true, characterData: true, attributeFilter: ATTRIBUTES };
  new MutationObserver(dispatch).observe(document.documentElement, OBSERVED);

  // viser sends one change of the controls of a tab in 50 ms, the newest. So of buttons that are pressed within one moment,
  // as in a busy page, some would be lost, and letters typed right before a press: here presses take turns, and wait for
  // letters. The next turn is counted from when the last one was, as timers that a busy page is late for all end at once.
  const HELD_BACK = 60; // ms
  const turns = []; // what waits for its turn
  let holding = false; // viser may hold back what the last turn was for
  let inTurn = false;
  let typedAt = -HELD_BACK; // the last letter
  const hasJustTyped = () => performance.now() - typedAt < HELD_BACK;
  addEventListener("input", () => { typedAt = performance.now(); }, true);
  function hold() {
    holding = true;
    setTimeout(() => {
      holding = turns.length > 0;
      if (!holding) return;
      if (!hasJustTyped()) turns.shift()();
      hold();
    }, HELD_BACK);
  }
  addEventListener("click", (event) => {
    const button = closest(event.target, PARTS.button);
    if (!button || inTurn) return;
    const waits = holding || hasJustTyped();
    if (!holding) hold();
    if (!waits) return;
    event.stopImmediatePropagation();
    turns.push(() => {
      inTurn = true;
      button.click();
      inTurn = false;
    });
  }, true);

  // Marks: where a message of ours comes between the changes of viser's controls. A timer that is set now ends after those
  // with which viser holds changes back, also changes of sliders, which take no turns. A mark is an answer to nobody's
  // question about the browser's storage, which viser ignores.
  const canMark = () => typeof window.__viserMutable?.sendMessage === "function";
  function mark(number) {
    const answer = { type: "LocalStorageGetItemResponseMessage", request_uuid: "kinboard-mark", value: String(number), error: null };
    const send = () => setTimeout(() => window.__viserMutable.sendMessage(answer), HELD_BACK);
    if (holding) turns.push(send);
    else { send(); hold(); }
  }

  const setValue = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  function type(input, text) {
    setValue.call(input, text);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }

  // Labels of the scene: viser draws black letters on a white box, whatever the colours of the page. Both are written into
  // its shaders as constants; here each of them is a mix of its light and its dark colour, by a uniform of ours.

  const SHADES = new Map([
    ["gl_FragColor = vec4(0.0, 0.0, 0.0, a);", "gl_FragColor = vec4(mix(vec3(0.0), vec3(0.94), kbDark), a);"], // letters
    ["gl_FragColor = vec4(1.0, 1.0, 1.0, 0.85 * vAlpha);", "gl_FragColor = vec4(mix(vec3(1.0), vec3(0.13, 0.15, 0.18), kbDark), 0.85 * vAlpha);"],
  ]);
  const shaded = new WeakSet(); // shaders with the uniform
  const shadedPrograms = new Map(); // program → its context
  const { shaderSource, attachShader, linkProgram } = WebGL2RenderingContext.prototype;
  const isDark = () => document.documentElement.dataset.mantineColorScheme === "dark";
  function shade(gl, program) {
    const used = gl.getParameter(gl.CURRENT_PROGRAM);
    gl.useProgram(program);
    gl.uniform1f(gl.getUniformLocation(program, "kbDark"), isDark() ? 1 : 0);
    gl.useProgram(used);
  }
  Object.assign(WebGL2RenderingContext.prototype, {
    shaderSource(shader, source) {
      const constant = [...SHADES.keys()].find((each) => source.includes(each));
      if (constant) {
        HOOKS.shadeLabel++;
        shaded.add(shader);
        source = source.replace(constant, SHADES.get(constant)).replace("void main() {", "uniform float kbDark;\nvoid main() {");
      }
      return shaderSource.call(this, shader, source);
    },
    attachShader(program, shader) {
      if (shaded.has(shader)) shadedPrograms.set(program, this);
      return attachShader.call(this, program, shader);
    },
    linkProgram(program) {
      linkProgram.call(this, program);
      if (shadedPrograms.has(program)) shade(this, program);
    },
  });
  watch(() => {
    for (const [program, gl] of shadedPrograms) {
      if (gl.isProgram(program)) shade(gl, program);
      else shadedPrograms.delete(program); // of a picture that is gone
    }
  }, { on: [COLOURS] });

  // viser puts its own state of the scene into `window.__viserMutable`, for its tests.

  const cameraWatchers = [];
  const lineWatchers = [];
  const tellLine = (what) => { for (const act of lineWatchers) act(what); };
  const entered = new WeakSet(); // what is looked into
  function enterViewer() {
    const canvas = document.querySelector(PARTS.scene);
    const viewer = window.__viserMutable;
    if (!canvas || !viewer) return;
    if (isNew(viewer.nodeRefFromName)) placeLabels(viewer);
    if (isNew(viewer.messageQueue)) dropVoidUpdates(viewer.messageQueue);
    if (!isNew(viewer)) return;
    if (viewer.sendMessage) hearSent(viewer);
    // A picture that rests is empty when viser changes its resolution, until it is drawn again.
    new MutationObserver(() => viewer.requestRender?.()).observe(canvas, { attributeFilter: ["width", "height"] });
  }
  watch(enterViewer, { delay: 50 });
  function isNew(thing) {
    const found = thing && !entered.has(thing);
    if (found) entered.add(thing);
    return found;
  }

  /** viser places the labels of a frame before it draws, where their parents were drawn last: a label came a frame after
   *  what it names, and a new one stood elsewhere for a frame. The parent it asks for is here moved to its present place. */
  function placeLabels(viewer) {
    viewer.nodeRefFromName = new Proxy(viewer.nodeRefFromName, {
      get(nodes, name) {
        const node = nodes[name];
        node?.updateWorldMatrix?.(true, false);
        HOOKS.findParent++;
        return node;
      },
    });
    entered.add(viewer.nodeRefFromName);
  }

  /** viser applies all updates that wait for a frame after all removals that wait for it. In a slow page an update then
   *  finds no component, which is an error in the console. It is void: it is taken away when the removal comes.
   *  A slider does not jump under the pointer that holds it: when it is released, the service says what it shows, if it
   *  was moved; otherwise it shows then what came meanwhile. */
  function dropVoidUpdates(queue) {
    const isFor = (id) => ({ type: kind, uuid, updates }) => kind === "GuiUpdateMessage" && uuid === id && "value" in updates;
    queue.push = (...received) => {
      for (const { type: kind, uuid } of received) {
        HOOKS.hear++;
        if (kind !== "GuiRemoveMessage") continue;
        if (uuid === held) missed = null;
        const kept = queue.filter((waiting) => waiting.type !== "GuiUpdateMessage" || waiting.uuid !== uuid);
        queue.splice(0, queue.length, ...kept);
      }
      const jumps = isFor(held), last = received.findLast(jumps);
      if (last) missed = () => queue.push(last);
      return Array.prototype.push.apply(queue, received.filter((message) => !jumps(message)));
    };
  }
  let held = null; // the id of the slider under the pressed pointer
  let heldValue = null; // what it showed when it was pressed
  let missed = null; // shows what came last for it meanwhile
  const valueAt = (id) => thumbOf(id)?.getAttribute(VALUE);
  addEventListener("pointerdown", ({ target }) => {
    held = closest(target, PARTS.slider)?.id ?? null;
    [heldValue, missed] = [held && valueAt(held), null];
  }, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    addEventListener(kind, () => {
      const show = held && valueAt(held) === heldValue ? missed : null;
      held = missed = null;
      show?.();
    }, true);
  }

  /** See what viser sends. */
  function hearSent(viewer) {
    let send = viewer.sendMessage;
    const pass = (message) => {
      if (message.type === "ViewerCameraMessage") {
        HOOKS.reportCamera++;
        for (const act of cameraWatchers) act(message.wxyz);
      }
      tellLine("sent");
      send(message);
    };
    // viser has another function for each connection, and one while there is none.
    const set = (given) => { send = given; tellLine("closed"); };
    Object.defineProperty(viewer, "sendMessage", { configurable: true, enumerable: true, get: () => pass, set });
    viewer.sendCamera?.();
  }

  // What another version of viser may lack, and what suffers. The page goes on without it, and says so.

  const NEEDED = [
    ["__viserMutable.nodeRefFromName", () => window.__viserMutable?.nodeRefFromName, "labels in the scene may come a moment late"],
    ["__viserMutable.messageQueue", () => window.__viserMutable?.messageQueue, "the browser’s console may show errors of removed controls"],
    ["__viserMutable.requestRender", () => window.__viserMutable?.requestRender, "the picture may be empty for a second"],
    ["__viserMutable.sendMessage", canMark, "Undo may pass a slider that was moved just before it"],
  ];
  const lacks = () => NEEDED.filter(([, test]) => !test()).map(([what, , suffers]) => `${what}: ${suffers}`);
  addEventListener("kinboard-there", () => {
    const found = lacks();
    if (!found.length) return;
    const close = dom.element("button", { type: "button" }, "Close");
    const note = dom.element("div", { id: "kb-lacks", role: "status" }, `This version of viser lacks ${found.join("; ")}. `, close);
    close.addEventListener("click", () => note.remove());
    document.body.append(note);
    console.warn(note.firstChild.textContent);
  }, { once: true });

  // Tabs

  const tabs = () => all(PARTS.tab);
  function openTab(title) {
    const tab = tabs().find((node) => textOf(node) === title);
    if (tab && tab.ariaSelected !== "true") {
      // A docked panel's own tabs listen to the keyboard and to dragging, those of a phone's sheet to clicks.
      tab.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true, cancelable: true }));
      tab.click();
    }
    return Boolean(tab);
  }
  function titleAt(node) {
    const tab = closest(node, PARTS.tab);
    return tab ? textOf(tab) : "";
  }

  // The panel: docked on a desk, a sheet on a phone.

  function sheetOf(node) {
    const sheet = closest(node, PARTS.paper);
    if (sheet?.style.position !== "fixed") return null;
    return { sheet, head: sheet.querySelector(PARTS.contents)?.firstElementChild };
  }
  function region() {
    const node = document.querySelector(PARTS.region);
    const edge = document.querySelector(PARTS.regionEdge);
    return node && edge ? { node, edge, outwards: edge.dataset.dockRegionResize === "left" ? 1 : -1 } : null;
  }
  /** As a pointer that moves the panel's edge would. */
  function widen(pixels) {
    const docked = region();
    if (!docked) return;
    const start = docked.edge.getBoundingClientRect().left;
    const end = start + docked.outwards * pixels;
    const at = (x) => ({ bubbles: true, pointerId: 1, isPrimary: true, button: 0, clientX: x });
    document.querySelector(PARTS.regionHandle).dispatchEvent(new PointerEvent("pointerdown", at(start)));
    dispatchEvent(new PointerEvent("pointermove", at(end)));
    dispatchEvent(new PointerEvent("pointerup", at(end)));
  }

  // Controls

  const lineAt = (node) => closest(node, PARTS.line);
  const thumbOf = (id) => document.getElementById(id)?.querySelector(PARTS.thumb);
  function fieldOf(id) {
    return document.getElementById(id).nextElementSibling?.querySelector("input");
  }
  /** The text in the field with this label, or "". */
  function valueOf(text) {
    const label = all(PARTS.label).find((node) => node.textContent === text);
    return lineAt(label)?.querySelector("input")?.value ?? "";
  }
  /** The element that shows a control's hint while the mouse is on it, from the control's label. */
  const hintedAt = (node) => lineAt(closest(node, PARTS.label))?.lastElementChild?.firstElementChild;
  /** The label of a control's line: the nearest box around the control with exactly one label. */
  function labelOf(node) {
    for (let box = node.parentElement; box; box = box.parentElement) {
      const labels = box.querySelectorAll("label");
      if (labels.length) return labels.length === 1 ? textOf(labels[0]) : "";
    }
    return "";
  }

  // Accessibility: names and keyboard access that viser does not provide.

  const NAMELESS = `${PARTS.thumb}[aria-label=""], ${PARTS.progress}:not([aria-label]), input:not([type="hidden"]):not([aria-label])`;
  const name = (node, text) => { if (text) node.setAttribute("aria-label", text); };

  function complete() {
    for (const node of all(NAMELESS)) {
      if (!node.labels?.length) name(node, labelOf(node) || (node.matches(PARTS.progress) ? "Progress" : ""));
    }
    for (const label of all(PARTS.label)) {
      const buttons = lineAt(label)?.querySelector("button:not([role])")?.parentElement;
      if (!buttons || buttons.role === "group" || document.getElementById(label.htmlFor)) continue;
      buttons.role = "group";
      name(buttons, textOf(label) || "Choices");
    }
    for (const [part, text] of [["settings", "Settings of the page"], ["commands", "Find by typing"]]) {
      for (const icon of all(PARTS[part])) {
        const button = icon.closest("button");
        if (!button.ariaLabel) name(button, text);
      }
    }
    for (const icon of all(PARTS.icon)) dom.set(icon, "ariaHidden", "true");
    for (const head of all(PARTS.folderHead)) {
      head.role = "button";
      head.tabIndex = 0;
      head.ariaExpanded = String(head.nextElementSibling?.getAttribute("aria-hidden") !== "true");
    }
  }
  watch(complete, { on: ["childList", "aria-hidden"], delay: 150 });

  dom.on("keydown", PARTS.folderHead, (head, event) => {
    if (!["Enter", " "].includes(event.key) || event.target !== head) return;
    event.preventDefault();
    head.click();
  });
  // A menu's field has the name of what is chosen, and viser's menus search for what is typed there: a click marks the
  // name, so that typing replaces it.
  dom.on("click", PARTS.menu, (field) => field.select());
  // Arrow keys on a control must not rotate the view as well.
  for (const kind of ["keydown", "keyup"]) {
    document.body.addEventListener(kind, (event) => {
      if (event.key.startsWith("Arrow") && event.target.matches("input, textarea, [role]")) event.stopPropagation();
    });
  }

  // viser leaves captured pointers to the handles of the scene, and browsers capture every touch: without this, a tap on
  // a point or a posture of the scene does nothing.
  addEventListener("pointerdown", (event) => {
    const { target, pointerId, pointerType } = event;
    if (pointerType === "touch" && target instanceof HTMLCanvasElement) target.releasePointerCapture(pointerId);
  }, true);

  // viser shows a control's hint while the mouse is on the control; here its label shows it as well.
  for (const [heard, sent] of [["mouseover", "mouseenter"], ["mouseout", "mouseleave"]]) {
    addEventListener(heard, (event) => hintedAt(event.target)?.dispatchEvent(new MouseEvent(sent)));
  }

  return {
    parts: PARTS,
    hooks: HOOKS,
    /** What this version of viser lacks, each with what suffers. */
    lacks,
    COLOURS,
    /** Call `act` after changes of the page of the kinds `on`: childList, characterData or an attribute of ATTRIBUTES.
     *  With a delay in ms, changes until then are one. */
    watch,
    noteChange,
    /** Call `act` with the camera's orientation (w, x, y, z) in the world frame when viser reports it. */
    watchCamera: (act) => { cameraWatchers.push(act); },
    /** Call `act` with "sent" when viser sends something to the service, and with "closed" when its connection ends or begins. */
    watchLine: (act) => { lineWatchers.push(act); },
    /** Call `act` when the value of a slider changes; `thumb` is what `thumbOf` returns. */
    watchValue: (thumb, act) => { valueWatchers.set(thumb, act); },

    /** Whether there are marks. */
    canMark,
    /** Put the number of a message between the changes of viser's controls made before it and those made later. */
    mark,

    /** Type into one of viser's fields, as if the visitor did. */
    type,
    /** Open the tab of the panel with this title; returns whether there is one. */
    openTab,
    /** The element of a tab by its title. */
    tab: (title) => tabs().find((node) => textOf(node) === title),
    /** The title of the tab at an element, or "". */
    titleAt,
    /** The titles of the open tabs; docked panels have one each. */
    openTitles: () => all(PARTS.openTab).map(textOf),
    /** The strip of tabs around an element of one of them, or undefined; the title of its open tab, or "". */
    stripAt: (node) => closest(node, PARTS.tab)?.parentElement,
    openTitleIn: (strip) => all(PARTS.openTab, strip).map(textOf)[0] ?? "",

    /** The element around all that viser draws. */
    page: () => document.querySelector(PARTS.page),
    /** The canvas of the scene. */
    scene: () => document.querySelector(PARTS.scene),
    /** The scrolling part of the panel, or null. */
    panel: () => closest(document.querySelector(PARTS.tab), PARTS.scrollArea),
    /** The phone's sheet around an element and its head: { sheet, head }, or null. */
    sheetOf,
    /** The docked panel: { node, edge, outwards }, or null. outwards: 1 where the panel grows to the right, else −1. */
    region,
    widen,
    /** The page's colour scheme: "dark", "light", or undefined until it has one. */
    colours: () => document.documentElement.dataset.mantineColorScheme,

    /** The line of the panel around an element, or null. */
    lineAt,
    labelOf,
    valueOf,
    /** The thumb of the slider with this id, and its number field. */
    thumbOf,
    fieldOf,
    /** All thumbs of sliders. */
    thumbs: () => all(PARTS.thumb),
    isThumb: (node) => node instanceof Element && node.matches(PARTS.thumb),
    isSlider: (node) => closest(node, PARTS.slider) !== null,
    isControl: (node) => closest(node, `input, textarea, select, button, a, summary, [contenteditable], ${PARTS.thumb}, ${PARTS.tab}, [role="option"]`) !== null,
    /** The tracks of sliders and the elements of ours that match a selector, in the order of the page. */
    tracksAnd: (selector) => all(`${PARTS.track}, ${selector}`),
    isTrack: (node) => node.matches(PARTS.track),
    /** viser's controls in the panel: fields, buttons, and the thumbs of sliders. */
    controls: () => all(`${PARTS.scrollArea} :is(${PARTS.line} :is(input, textarea), ${PARTS.button}, ${PARTS.thumb})`),
    /** The nearest box around an element that holds a control of viser's, or null: of a part of a tab, all of the tab. */
    boxOf(node) {
      while (node && !node.querySelector(PARTS.line)) node = node.parentElement;
      return node;
    },
    /** All buttons of viser's. */
    buttons: () => all(PARTS.button),
  };
})();
