"use strict";
// Runs in viser's page: keys of a single letter can be switched off in the tab View, for those who speak to their computer
// or press keys by accident. The choice is kept in this browser.
(() => {
  const STORE = "kinboard-letter-keys";
  let on = true;
  try { on = localStorage.getItem(STORE) !== "off"; } catch { /* a browser may forbid storage */ }

  function mark() {
    for (const button of document.querySelectorAll("[data-letter-keys]")) {
      const pressed = String((button.dataset.letterKeys === "on") === on);
      if (button.ariaPressed !== pressed) button.ariaPressed = pressed;
    }
  }
  addEventListener("click", (event) => {
    const button = event.target instanceof Element ? event.target.closest("[data-letter-keys]") : null;
    if (!button) return;
    on = button.dataset.letterKeys === "on";
    try { localStorage.setItem(STORE, on ? "on" : "off"); } catch { /* see above */ }
    mark();
  });
  // Before all other scripts, viser's included. A text that is being typed gets its letters.
  for (const kind of ["keydown", "keyup"]) {
    addEventListener(kind, (event) => {
      if (on || event.key.length !== 1 || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key !== " " && !event.target.matches?.("input, textarea, select, [contenteditable]")) event.stopImmediatePropagation();
    }, true);
  }
  viserPage.watch(mark, { delay: 50 });
})();
