"use strict";
// Runs in viser's page: where one may only look, and in a class that is frozen, what acts is disabled, so that no slider, field
// or list shows what the arm does not. It comes back as soon as one may act again. What only changes how this page shows things
// stays, as does what stops a connected program.
(() => {
  // Ours that acts on nothing but this page, or is let through (LOOKS in app/shared/security.py).
  const FREE = [
    "[data-frame]", "[data-text-size]", "[data-letter-keys]", "[data-keys-open]", "[data-copy]", "[data-wide-do]", "[data-arm-more]",
    "[data-slow-close]", '[data-feature="connect"] [data-guide-do="halt"]', '[data-feature="connect"] [data-guide-do="stop"]',
  ].join();
  // In a frozen class, the tab Class and worksheets (Feature.acts) are free as well, and viser's buttons without a label, by which
  // features begin and end their work: one of them withdraws the code of a connected program.
  const FREE_IN_CLASS = '[data-feature="class"] *, [data-sheet-do]';
  const OURS = "[data-part] :is(button, input, select, textarea)";

  const off = new WeakSet(); // what is disabled here, and not by viser or the service
  const isOff = (control) => (viserPage.isThumb(control) ? control.ariaDisabled === "true" : control.disabled);
  function turn(control, acts) {
    if (acts ? !off.has(control) : isOff(control)) return; // one that was enabled again meanwhile is disabled again
    off[acts ? "delete" : "add"](control);
    if (!viserPage.isThumb(control)) control.disabled = !acts;
    else {
      control.ariaDisabled = acts ? null : "true";
      control.tabIndex = acts ? 0 : -1;
      if (!acts) control.blur(); // viser's own arrow keys would move it
    }
  }

  let looked = false; // whether something may be disabled
  function follow() {
    const acts = channel.mayAct();
    if (acts && !looked) return;
    looked = !acts;
    const inClass = document.querySelector("[data-looking]") === null;
    const free = inClass ? `${FREE}, ${FREE_IN_CLASS}` : FREE;
    document.documentElement.toggleAttribute("data-kb-looks", !acts);
    for (const control of dom.all(OURS)) turn(control, acts || control.matches(free));
    const view = viserPage.boxOf(document.querySelector("[data-looks]")); // the tab View
    for (const control of viserPage.controls()) {
      turn(control, acts || Boolean(view?.contains(control)) || (inClass && !viserPage.lineAt(control)));
    }
  }
  viserPage.watch(follow, { on: ["childList", "disabled"] });
})();
