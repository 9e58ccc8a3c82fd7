"use strict";
// Runs in viser's page: what is too wide for the panel opens as a drawer below the scene, over its whole width, and goes
// back, with the key B or the button of each such part. A part has the attribute data-wide; static/drawer.css moves it,
// so that the service may write it anew at any time.
(() => {
  const SAVED = "kinboard-drawer";
  const root = document.documentElement;
  const SMALL = matchMedia("(max-width: 36em), (max-height: 30em)"); // a picture that has nothing to give away

  if (root.dataset.kbEmbed) return;
  let wanted = dom.tab.get(SAVED) === "open";

  const parts = () => dom.all("[data-wide]").filter((node) => node.checkVisibility());

  /** How high the contents of a part are, with its border and padding, whatever height it has. */
  function contents(part) {
    const pixels = (node, ...names) => names.reduce((sum, name) => sum + parseFloat(getComputedStyle(node)[name]), 0);
    const shown = [...part.children].filter((node) => node.offsetHeight > 0);
    const ends = shown.map((node) => node.getBoundingClientRect().bottom + pixels(node, "marginBottom"));
    const start = Math.min(...shown.map((node) => node.getBoundingClientRect().top));
    return pixels(part, "borderTopWidth", "paddingTop", "paddingBottom") + Math.max(...ends) - start;
  }

  // The sizes of what is in a part also tell when it comes and goes with its tab, however late viser draws that.
  const sizes = new ResizeObserver(() => requestAnimationFrame(show)); // what it changes are sizes again
  let measured = [];
  function measure() {
    const nodes = dom.all("[data-wide] > *");
    if (nodes.length === measured.length && nodes.every((node, i) => node === measured[i])) return;
    measured = nodes;
    sizes.disconnect();
    for (const node of nodes) sizes.observe(node);
  }

  /** The drawer is there while it is wanted and the open tab has something for it, as high as the higher one of its parts. */
  function show() {
    measure();
    const shown = parts(), open = wanted && !SMALL.matches && shown.length > 0;
    if (open !== root.hasAttribute("data-kb-drawer")) root.toggleAttribute("data-kb-drawer", open);
    for (const button of dom.all("[data-wide-do]")) dom.set(button, "ariaPressed", String(open));
    if (!open) return;
    const high = `${Math.ceil(Math.max(...shown.map(contents)))}px`;
    if (root.style.getPropertyValue("--kb-contents") !== high) root.style.setProperty("--kb-contents", high);
  }

  function toggle() {
    wanted = !root.hasAttribute("data-kb-drawer");
    dom.tab.set(SAVED, wanted ? "open" : "");
    show();
  }

  dom.on("click", "[data-wide-do]", toggle);
  addEventListener("keydown", (event) => {
    if (event.code !== "KeyB" || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey || event.repeat) return;
    const typing = event.target.matches("input:not([type=checkbox], [type=radio], [type=range]), textarea, select, [contenteditable]");
    if (typing || SMALL.matches || !parts().length) return;
    event.preventDefault();
    toggle();
  });
  viserPage.watch(show, { on: ["childList", "aria-hidden"], delay: 50 });
  SMALL.addEventListener("change", show);
})();
