"use strict";
// Runs in viser's page: what the keys do, as an overview (static/viewer.html) that the key ? and a button in the tab View
// open. There, keys of a single letter can also be switched off, for those who speak to their computer or press keys by
// accident. The choice is kept in this browser. A row with data-acts is not for those who may only look.
// Within another page (?embed=…), what has data-whole is not there, and what has data-panel only beside a panel. What has
// data-drawer is not there in a small window (drawer.css).
//
// docs/teaching.md and docs/own-arm.md have the same list, which a test compares; input.js, drawer.js and robot.js act.
(() => {
  const { on, set } = dom;
  const STORE = "kinboard-letter-keys";
  const CAP = /(Ctrl|Shift|Alt|Tab|Enter|Esc|PageUp|PageDown|Home|End|\b[A-Z]\b|[↑↓←→?])/;
  const MAC = { Ctrl: "⌘", Alt: "⌥" };
  const isMac = navigator.platform.startsWith("Mac");
  let letters = dom.browser.get(STORE) !== "off";

  function mark() {
    for (const button of dom.all("[data-letter-keys]")) set(button, "ariaPressed", String((button.dataset.letterKeys === "on") === letters));
  }
  on("click", "[data-letter-keys]", (button) => {
    letters = button.dataset.letterKeys === "on";
    dom.browser.set(STORE, letters ? "on" : "off");
    mark();
  });

  // The overview

  const overview = document.getElementById("kb-keys");
  /** The words of a row, with its keys drawn as keys. */
  const cap = (part, i) => (i % 2 ? dom.element("kbd", {}, (isMac && MAC[part]) || part) : part);
  const drawn = (keys) => keys.split(/( )/).map((word) => dom.element("span", {}, ...word.split(CAP).map(cap)));
  for (const cell of dom.all("th", overview)) cell.replaceChildren(...drawn(cell.textContent));
  function open() {
    overview.toggleAttribute("data-only-looking", !channel.mayAct());
    overview.showModal();
  }
  on("click", "[data-keys-open]", open);
  on("click", "[data-keys-close]", () => overview.close());
  overview.addEventListener("click", (event) => { if (event.target === overview) overview.close(); }); // beside its contents

  // Before all other scripts, viser's included. A text that is being typed gets its letters.
  for (const kind of ["keydown", "keyup"]) {
    addEventListener(kind, (event) => {
      if (document.querySelector("dialog:modal")) { event.stopImmediatePropagation(); return; } // the browser itself closes it with Esc
      if (event.key.length !== 1 || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.target.matches?.("input, textarea, select, [contenteditable]") && event.target.type !== "checkbox") return;
      if (!letters && event.key !== " ") event.stopImmediatePropagation();
      if (!letters || event.key !== "?" || kind !== "keydown") return;
      event.preventDefault();
      event.stopImmediatePropagation();
      open();
    }, true);
  }
  viserPage.watch(mark, { delay: 50 });
})();
