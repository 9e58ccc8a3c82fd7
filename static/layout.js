"use strict";
// Runs in viser's page. It places what lies over the scene: the status card, and on a phone the panel as a sheet.
//
// The sheet has three heights: peek, half and full. It is dragged or tapped by its head or its grip. The scene gets
// what the sheet leaves; a full sheet covers part of it.
(() => {
  const NARROW = matchMedia("(max-width: 36em)"); // the width at which viser's panel becomes a sheet
  const STEPS = ["peek", "half", "full"];
  const HEAD = 56; // px; height of a sheet that peeks
  const STATUS = 72; // px; of the scene's top, kept for the status card: longer texts cover part of the scene
  const TAP = 8; // px; a shorter drag is a tap
  const SAVED = "kinboard-sheet";
  const root = document.documentElement;

  // Factors of the text sizes in the tab View, as in layout.css.
  const TEXT = "kinboard-text-size";
  const SIZES = { Normal: 1, Large: 1.3, Projector: 1.7 };
  let size = Object.hasOwn(SIZES, dom.browser.get(TEXT)) ? dom.browser.get(TEXT) : "Normal";

  let step = STEPS.includes(dom.tab.get(SAVED)) ? dom.tab.get(SAVED) : "half";
  let drag = null; // { y, height, moved, speed, at } while a pointer holds the sheet
  const grip = document.getElementById("kb-grip");

  const card = () => document.querySelector("[data-status]");

  function heightOf(name) {
    if (name === "peek") return HEAD;
    const half = Math.round(innerHeight / 2);
    return name === "half" ? half : Math.max(half, innerHeight - Math.max(STATUS, card()?.offsetHeight ?? 0));
  }

  function setHeight(pixels) { root.style.setProperty("--kb-sheet", `${Math.round(pixels)}px`); }

  /** Write the sheet's height and the scene's edges into the styles. */
  function place() {
    root.toggleAttribute("data-kb-narrow", NARROW.matches);
    root.dataset.kbSheet = step;
    root.dataset.kbText = NARROW.matches ? "Normal" : size;
    if (!drag) setHeight(heightOf(step));
    root.style.setProperty("--kb-below", `${heightOf(step === "peek" ? "peek" : "half")}px`);
    root.style.setProperty("--kb-above", `${STATUS}px`);
    tellSize();
    grip.hidden = !NARROW.matches;
    grip.ariaLabel = `Panel: ${step === "peek" ? "closed" : `${step} height`}. Press to change its height.`;
    grip.ariaExpanded = String(step !== "peek");
  }

  function choose(name) {
    step = name;
    dom.tab.set(SAVED, step);
    place();
  }

  function tap() { choose(STEPS[(STEPS.indexOf(step) + 1) % STEPS.length]); }

  /** The step whose height is nearest to where the sheet was let go, a moment later at its present speed. */
  function settle(height) {
    const near = (name) => Math.abs(heightOf(name) - height);
    choose(STEPS.reduce((best, name) => (near(name) < near(best) ? name : best)));
  }

  const held = ({ target }) => NARROW.matches && (target === grip || (dom.closest(target, "[data-kb-head]") && !dom.closest(target, "button, input, a")));

  addEventListener("pointerdown", (event) => {
    if (drag || !event.isPrimary || event.button !== 0 || !held(event)) return;
    drag = { id: event.pointerId, y: event.clientY, height: heightOf(step), moved: false, speed: 0, last: event };
    root.toggleAttribute("data-kb-dragging", true);
  }, true);
  addEventListener("pointermove", (event) => {
    if (event.pointerId !== drag?.id) return;
    const time = Math.max(1, event.timeStamp - drag.last.timeStamp);
    drag.speed = 0.5 * drag.speed + 0.5 * (drag.last.clientY - event.clientY) / time;
    drag.last = event;
    drag.moved ||= Math.abs(event.clientY - drag.y) > TAP;
    if (drag.moved) setHeight(Math.min(heightOf("full"), Math.max(HEAD, drag.height + drag.y - event.clientY)));
  }, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    addEventListener(kind, (event) => {
      if (event.pointerId !== drag?.id) return;
      const { moved, height, y, speed } = drag;
      const ahead = Math.min(Math.max(100 * speed, -100), 100); // px; a flick carries the sheet a little farther
      drag = null;
      root.toggleAttribute("data-kb-dragging", false);
      if (moved) settle(height + y - event.clientY + ahead);
      else if (kind === "pointerup") tap();
    }, true);
  }
  // viser's own sheet would open and close with a click on its head.
  addEventListener("click", (event) => {
    if (!held(event)) return;
    event.stopPropagation();
    if (event.detail === 0) tap(); // the grip was pressed with a key
  }, true);
  addEventListener("keydown", (event) => {
    if (event.target !== grip || !["ArrowUp", "ArrowDown"].includes(event.key)) return;
    event.preventDefault();
    const next = STEPS.indexOf(step) + (event.key === "ArrowUp" ? 1 : -1);
    choose(STEPS[Math.min(Math.max(next, 0), STEPS.length - 1)]);
  }, true);

  // Where a phone is turned, viser builds the panel anew and opens its first tab: open the one that was open.
  const SETTLED = 2000; // ms until the new panel stays as it is
  let opened = "";
  const reopen = () => viserPage.openTab(opened);
  NARROW.addEventListener("change", () => {
    const timer = setInterval(reopen, 100);
    setTimeout(clearInterval, SETTLED, timer);
  });
  addEventListener("click", (event) => {
    opened = viserPage.titleAt(event.target) || opened;
  }, true);

  /** Mark the parts of viser's sheet for the styles. */
  function mark() {
    const found = viserPage.sheetOf(card());
    if (!found || found.sheet.hasAttribute("data-kb-panel")) return;
    found.sheet.setAttribute("data-kb-panel", "");
    found.head?.setAttribute("data-kb-head", "");
  }

  // The width of the panel on a desk: moved at its edge, by mouse or arrow keys, and kept for the next visit.

  const WIDTH = "kinboard-panel-width";
  const STRIDE = 24; // px; for one key
  const LEAST = 200; // px; a narrower panel is folded away
  const kept = () => Number(dom.browser.get(WIDTH) ?? NaN); // width that the visitor has chosen
  const chosen = () => kept() >= LEAST;
  let wished = kept(); // width of the last visit, until the panel has it

  // Where the visitor has chosen no width, it follows that of the window: 380 px of 1280, 440 of 1440, 520 of 1920 and more.
  const standard = () => Math.min(Math.max(344, Math.min(0.375 * innerWidth - 100, innerWidth / 6 + 200)), 520);
  const usual = () => Math.min(Math.round(SIZES[root.dataset.kbText] * standard()), innerWidth / 2);

  let fresh = !(wished >= LEAST); // nobody has chosen a width in this browser
  let byHand = false; // the visitor has moved the edge: what follows the window is nobody's choice, even if the window is wider again

  function keepWidth() {
    const docked = viserPage.region();
    const width = docked?.node.offsetWidth ?? 0;
    if (width < LEAST) return;
    Object.assign(docked.edge, { ariaValueMin: String(LEAST), ariaValueMax: String(innerWidth), ariaValueNow: String(width) });
    if (root.dataset.kbEmbed) return; // another page has placed it
    if (fresh && !NARROW.matches) {
      fresh = false;
      wished = usual();
    }
    if (wished >= LEAST) {
      const change = Math.min(wished, innerWidth / 2) - width;
      wished = NaN;
      if (Math.abs(change) > 1) requestAnimationFrame(() => viserPage.widen(change));
      return;
    }
    if (!byHand) return;
    if (Math.abs(width - usual()) < 2) dom.browser.remove(WIDTH);
    else dom.browser.set(WIDTH, String(width));
  }
  addEventListener("pointerdown", (event) => {
    byHand ||= event.isTrusted && event.target instanceof Node && viserPage.region()?.edge.contains(event.target);
  }, true);
  let follows = 0; // a window that is being made wider sends many events
  addEventListener("resize", () => {
    clearTimeout(follows);
    if (NARROW.matches || root.dataset.kbEmbed || chosen()) return;
    follows = setTimeout(() => {
      const width = viserPage.region()?.node.offsetWidth ?? 0;
      if (chosen() || width < LEAST || Math.abs(usual() - width) <= 1) return; // the edge's own moves resize the scene
      byHand = false;
      viserPage.widen(usual() - width);
    }, 150);
  });

  // The size of the text. All lengths of the panel follow the page's font size, and so does its width.

  function chooseSize(name) {
    const width = viserPage.region()?.node.offsetWidth ?? 0;
    const [factor, isOwn] = [SIZES[name] / SIZES[size], chosen()];
    size = name;
    byHand ||= isOwn; // the chosen width grows with the text
    dom.browser.set(TEXT, size);
    place();
    markSize();
    if (width >= LEAST && factor !== 1) viserPage.widen((isOwn ? Math.min(factor * width, innerWidth / 2) : usual()) - width);
  }

  /** Labels in the scene have the size of the text too: the server draws them. A new panel has not heard of it. */
  let told = { session: "", size: "" };
  function tellSize() {
    const session = channel.name();
    const now = root.dataset.kbText;
    if (!session || (told.session === session && told.size === now)) return;
    told = { session, size: now };
    channel.send("text-size", now);
  }

  function markSize() {
    for (const button of dom.all("[data-text-size]")) dom.set(button, "ariaPressed", String(button.dataset.textSize === size));
  }

  dom.on("click", "[data-text-size]", (button) => chooseSize(button.dataset.textSize));

  /** Make the panel's edge a control for the keyboard too. */
  function markEdge() {
    const docked = viserPage.region();
    if (!docked || docked.edge.role) return;
    const { node, edge, outwards } = docked;
    Object.assign(edge, { tabIndex: 0, role: "separator", ariaOrientation: "vertical", ariaLabel: "Width of the panel" });
    edge.addEventListener("keydown", (event) => {
      const way = ["ArrowRight", "ArrowLeft"].indexOf(event.key);
      if (way < 0) return;
      event.preventDefault();
      event.stopPropagation();
      byHand = true;
      viserPage.widen((way === 0 ? outwards : -outwards) * STRIDE);
    });
    new ResizeObserver(keepWidth).observe(node);
  }

  /** Where the scene is in the window: the status card lies at its top. */
  let watched = null;
  const edges = new ResizeObserver(() => {
    const { left, right } = watched.getBoundingClientRect();
    root.style.setProperty("--kb-left", `${left}px`);
    root.style.setProperty("--kb-right", `${innerWidth - right}px`);
    root.dataset.kbDocked = NARROW.matches ? "below" : innerWidth - right > LEAST ? "right" : left > LEAST ? "left" : "";
  });
  function watch() {
    const canvas = viserPage.scene();
    if (!canvas || canvas === watched) return;
    edges.disconnect();
    watched = canvas;
    edges.observe(canvas);
  }

  // A press hides the hint of a control until the pointer comes to another control.
  const lineOf = (node) => viserPage.lineAt(node) ?? dom.closest(node, "button, input");
  let pressed = null;
  function press(line) {
    pressed = line;
    root.toggleAttribute("data-kb-pressed", line !== null);
  }
  addEventListener("pointerdown", (event) => press(lineOf(event.target)), true);
  addEventListener("pointerover", (event) => { if (pressed && lineOf(event.target) !== pressed && !event.buttons) press(null); }, true);

  place();
  function follow() {
    root.style.setProperty("--kb-card", `${card()?.offsetHeight ?? 0}px`);
    mark();
    markEdge();
    markSize();
    tellSize();
    watch();
  }
  viserPage.watch(follow, { delay: 50 });
  addEventListener("resize", place);
  NARROW.addEventListener("change", place);
})();
