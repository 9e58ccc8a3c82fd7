"use strict";
// Runs in viser's page: what the keys do, as an overview that the key ? and a button in the tab View open. There, keys of
// a single letter can also be switched off, for those who speak to their computer or press keys by accident. The choice
// is kept in this browser.
// A row with true is for those, too, who may only look.
//
// docs/teaching.md and docs/own-arm.md have the same list, which a test compares; input.js, drawer.js and robot.js act.
(() => {
  const STORE = "kinboard-letter-keys";
  const KEYS = [
    ["Anywhere", [
      ["Ctrl+Z; Ctrl+Shift+Z or Ctrl+Y", "undo; redo"],
      ["Ctrl+K", "find a tab, lesson, exercise, arm or action by typing"],
      ["?", "this overview", true],
    ]],
    ["A joint's slider", [
      ["arrow keys; with Shift", "1°; 0.1° (0.01 and 0.001 rad; 1 and 0.1 mm)"],
      ["PageUp, PageDown", "10° (0.1 rad, 10 mm)"],
      ["Home, End", "lower and upper limit"],
    ]],
    ["The field beside it", [
      ["Enter; Esc", "set the typed value; restore"],
      ["↑, ↓, PageUp, PageDown", "as on the slider"],
    ]],
    ["The DH table", [
      ["Tab, Enter", "next field (with Shift: the one before)"],
      ["↑ ↓, and ← → at the end of a text", "the field beside it"],
      ["Alt+↑, Alt+↓, Alt+Enter", "move the row, add a row"],
      ["Esc", "discard what is wrong"],
    ]],
    ["Scene", [
      ["J, L", "move the target along x, 10 mm back and forth"],
      ["K, I", "along y"],
      ["U, O", "along z"],
      ["Shift with these", "1 mm"],
      ["Alt with these", "turn about the axis by 5°, with Shift by 1°"],
      ["G", "switch the axes of keys and arrows: tool or base (also in the tab View)"],
      ["T", "type a target"],
      ["B", "tabs Robot and Program: table, rows and plot below the scene over its whole width, and back", true],
      ["Shift while dragging the arrows", "steps of 10 mm and 5°"],
      ["W, A, S, D, Q, E, arrow keys", "move the camera", true],
    ]],
  ];
  const CAP = /(Ctrl|Shift|Alt|Tab|Enter|Esc|PageUp|PageDown|Home|End|\b[A-Z]\b|[↑↓←→?])/;
  const MAC = { Ctrl: "⌘", Alt: "⌥" };
  const isMac = navigator.platform.startsWith("Mac");
  let on = true;
  try { on = localStorage.getItem(STORE) !== "off"; } catch { /* a browser may forbid storage */ }

  function mark() {
    for (const button of document.querySelectorAll("[data-letter-keys]")) {
      const pressed = String((button.dataset.letterKeys === "on") === on);
      if (button.ariaPressed !== pressed) button.ariaPressed = pressed;
    }
  }

  // The overview

  let overview = null;
  function element(kind, text = "", ...children) {
    const made = document.createElement(kind);
    made.append(text, ...children);
    return made;
  }
  /** The words of a row, with its keys drawn as keys. */
  const cap = (part, i) => (i % 2 ? element("kbd", (isMac && MAC[part]) || part) : part);
  const drawn = (keys) => keys.split(/( )/).map((word) => element("span", "", ...word.split(CAP).map(cap)));

  function build() {
    const dialog = element("dialog");
    dialog.id = "kb-keys";
    const title = element("h2", "Keys");
    title.id = "kb-keys-title";
    dialog.setAttribute("aria-labelledby", title.id);
    const close = element("button", "Close");
    close.type = "button";
    close.addEventListener("click", () => dialog.close());
    const head = element("header", title, close);
    const list = element("div");
    list.className = "kb-keys-list";
    list.tabIndex = 0; // so that it can be scrolled without a mouse
    for (const [where, rows] of KEYS) {
      const table = element("table", element("caption", where));
      for (const [keys, action, looking] of rows) {
        const line = table.insertRow();
        if (!looking) line.dataset.acts = "";
        line.append(element("th", ...drawn(keys)), element("td", action));
        line.firstChild.scope = "row";
      }
      list.append(table);
    }
    const note = element("p", "Keys of the scene work after a click into it. Keys of a single letter can be switched off in the tab View.");
    dialog.append(head, list, note);
    dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); }); // beside its contents
    document.body.append(dialog);
    return dialog;
  }
  function open() {
    overview ??= build();
    overview.toggleAttribute("data-only-looking", document.querySelector("[data-looking]") !== null);
    if (!overview.open) overview.showModal();
  }

  addEventListener("click", (event) => {
    if (!(event.target instanceof Element)) return;
    if (event.target.closest("[data-keys-open]")) open();
    const button = event.target.closest("[data-letter-keys]");
    if (!button) return;
    on = button.dataset.letterKeys === "on";
    try { localStorage.setItem(STORE, on ? "on" : "off"); } catch { /* see above */ }
    mark();
  });
  // Before all other scripts, viser's included. A text that is being typed gets its letters.
  for (const kind of ["keydown", "keyup"]) {
    addEventListener(kind, (event) => {
      if (document.querySelector("dialog:modal")) { event.stopImmediatePropagation(); return; } // the browser itself closes it with Esc
      if (event.key.length !== 1 || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.target.matches?.("input, textarea, select, [contenteditable]") && event.target.type !== "checkbox") return;
      if (!on && event.key !== " ") event.stopImmediatePropagation();
      if (!on || event.key !== "?" || kind !== "keydown") return;
      event.preventDefault();
      event.stopImmediatePropagation();
      open();
    }, true);
  }
  viserPage.watch(mark, { delay: 50 });
})();
