"use strict";
// Runs in viser's page, before viser's own script. It stores the page's state per tab: the state that the server sends
// is kept in the URL and in sessionStorage, and returned to the server after a reload or a lost connection. The server
// uses viser's access to localStorage for this. All tabs of a browser share localStorage, so our items are redirected.
// Each state has an entry in the browser's history: Back returns to the one before.
(() => {
  const ITEM = "viser-user:kinboard";
  const REPLACE = `${ITEM}-replace`; // the same state from another viewpoint
  const RETURN = `${ITEM}-return`; // a state that has an entry
  const STATE = "kinboard-state";
  const TAB = "kinboard-tab";
  const { getItem, setItem } = Storage.prototype;
  const replaceState = history.replaceState.bind(history);
  const embedded = window !== window.top; // whose history belongs to the outer page

  // A browser may forbid storage; then only the URL keeps the state.
  const recall = (name) => { try { return getItem.call(sessionStorage, name); } catch { return null; } };
  const keep = (name, value) => { try { setItem.call(sessionStorage, name, value); } catch { /* see above */ } };

  const fragment = new URLSearchParams(location.hash.slice(1));
  const shared = fragment.has("s");
  let state = fragment.get("s") ?? recall(STATE) ?? "";
  let tab = fragment.get("tab") ?? (shared ? "" : recall(TAB)) ?? "";
  if (shared) { keep(STATE, state); keep(TAB, tab); }

  // Never connect to another server or play a recording, whatever the URL contains.
  const query = new URLSearchParams(location.search);
  query.delete("websocket");
  query.delete("playbackPath");
  const page = location.pathname + (query.size ? `?${query}` : "");
  // ?embed=1: the scene alone; ?embed=panel: with a small panel. Both have a link to the whole page.
  const mode = { 1: "scene", panel: "panel" }[query.get("embed")] ?? "";
  if (mode) document.documentElement.dataset.kbEmbed = mode;
  let at = history.state?.kinboard ?? 0; // the present entry
  const loaded = at;
  const trail = []; // the state of each entry, as far as known
  trail[at] = state;
  // viser derives the websocket's address from the page's, where a fragment is an error: `show` restores it.
  replaceState({ kinboard: at }, "", page);

  function address() {
    const parts = [];
    if (state) parts.push(`s=${state}`);
    if (tab) parts.push(`tab=${encodeURIComponent(tab)}`);
    return parts.length ? `${page}#${parts.join("&")}` : page;
  }
  const show = () => { trail[at] = state; replaceState({ kinboard: at }, "", address()); aim(); };
  function aim() {
    const whole = document.getElementById("kb-open");
    if (whole) whole.href = location.pathname + (state ? `#s=${state}` : "");
  }

  function add() {
    if (embedded) { show(); return; }
    history.pushState({ kinboard: ++at }, "", address());
    trail.length = at;
    trail[at] = state;
  }

  // The server may write the state with which this page was loaded in other words.
  const start = () => JSON.parse(document.querySelector("[data-answers]")?.dataset.answers ?? "{}").start ?? "";
  let expected = false; // whether the next move in the history is our own
  function goBack() {
    const near = [...trail.keys()].filter((i) => trail[i] === state || (i === loaded && state === start()));
    const to = near.sort((a, b) => Math.abs(a - at) - Math.abs(b - at))[0];
    if (to === undefined || embedded) add();
    else if (to === at) show();
    else { expected = true; history.go(to - at); }
  }

  addEventListener("popstate", (event) => {
    if (event.state?.kinboard === undefined) return;
    at = event.state.kinboard;
    state = new URLSearchParams(location.hash.slice(1)).get("s") ?? "";
    keep(STATE, state);
    show(); // the tab may be another one now
    if (!expected) dispatchEvent(new CustomEvent("kinboard-travel", { detail: at === loaded ? start() || state : state }));
    expected = false;
  });

  // viser would write the websocket's address into the page's URL, and a shared link would contain it.
  history.replaceState = show;
  addEventListener("hashchange", () => { if (history.state?.kinboard === undefined) location.reload(); });

  // A browser may forbid storage, most often to a page in a frame of another site: then items live as long as the page.
  for (const name of ["localStorage", "sessionStorage"]) {
    try { void window[name]; } catch {
      const items = new Map();
      const memory = Object.create(Storage.prototype, {
        kept: { value: { getItem: (key) => items.get(key) ?? null, setItem: (key, value) => { items.set(key, String(value)); } } },
        removeItem: { value: (key) => { items.delete(key); } },
      });
      Object.defineProperty(window, name, { value: memory });
    }
  }

  Storage.prototype.getItem = function (name) {
    if (name !== ITEM) return this.kept ? this.kept.getItem(name) : getItem.call(this, name);
    openTab(performance.now() + 30000);
    dispatchEvent(new Event("kinboard-connect"));
    const address = location.origin + location.pathname.replace(/viewer\/?$/, "");
    const text = document.documentElement.dataset.kbText;
    return JSON.stringify({ address, state, text, embedded: mode, shown: query.get("shown") ?? "", dark: matchMedia("(prefers-color-scheme: dark)").matches });
  };
  Storage.prototype.setItem = function (name, value) {
    if (![ITEM, REPLACE, RETURN].includes(name)) return this.kept ? this.kept.setItem(name, value) : setItem.call(this, name, value);
    state = value;
    keep(STATE, state);
    ({ [ITEM]: add, [REPLACE]: show, [RETURN]: goBack })[name]();
  };

  const tabs = () => [...document.querySelectorAll('[role="tab"]')];
  const label = (node) => node.textContent.trim();

  // The controls appear some time after the state was requested, with the first tab open.
  function openTab(until) {
    if (!tab || performance.now() > until) return;
    const found = tabs().find((node) => label(node) === tab);
    if (!found || document.querySelector("[data-status]") === null) setTimeout(openTab, 100, until);
    else if (found.getAttribute("aria-selected") !== "true") {
      // The panel's own tabs listen to the keyboard and to dragging, those of a phone's sheet to clicks.
      found.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true, cancelable: true }));
      found.click();
    }
  }

  function noteTab(event) {
    const strip = event.target instanceof Element ? event.target.closest('[role="tab"]')?.parentElement : null;
    if (!strip || !event.isTrusted) return;
    setTimeout(() => {
      const chosen = strip.querySelector('[role="tab"][aria-selected="true"]');
      if (!chosen) return;
      tab = label(chosen);
      keep(TAB, tab);
      show();
    }, 100);
  }
  addEventListener("click", noteTab);
  addEventListener("keyup", noteTab);

  // Accessibility: names and keyboard access that viser does not provide.

  const NAMELESS = '[role="slider"][aria-label=""], [role="progressbar"]:not([aria-label]), input:not([type="hidden"]):not([aria-label])';
  const FOLDER = ".mantine-Paper-root > .mantine-Paper-root:has(> .tabler-icon-chevron-up, > .tabler-icon-chevron-down)";
  const name = (node, text) => { if (node && text) node.setAttribute("aria-label", text); };

  /** The label of a control's line in the panel: the nearest box around the control with exactly one label. */
  function lineLabel(node) {
    for (let box = node.parentElement; box; box = box.parentElement) {
      const labels = box.querySelectorAll("label");
      if (labels.length) return labels.length === 1 ? labels[0] : null;
    }
    return null;
  }

  function complete() {
    for (const node of document.querySelectorAll(NAMELESS)) {
      if (node.labels?.length) continue;
      const found = lineLabel(node);
      name(node, found ? label(found) : node.role === "progressbar" ? "Progress" : "");
    }
    for (const found of document.querySelectorAll("label[for]")) {
      const line = found.closest(".mantine-Flex-root");
      const buttons = line?.querySelector("button:not([role])")?.parentElement;
      if (!buttons || buttons.role === "group" || document.getElementById(found.htmlFor)) continue;
      buttons.role = "group";
      name(buttons, label(found) || "Choices");
    }
    for (const icon of document.querySelectorAll("button:not([aria-label]) .tabler-icon-adjustments")) {
      name(icon.closest("button"), "Settings of the page");
    }
    for (const head of document.querySelectorAll(FOLDER)) {
      head.role = "button";
      head.tabIndex = 0;
      head.ariaExpanded = String(head.nextElementSibling?.getAttribute("aria-hidden") !== "true");
    }
  }

  let waiting = 0;
  addEventListener("DOMContentLoaded", () => {
    if (mode) {
      const whole = document.createElement("a");
      Object.assign(whole, { id: "kb-open", target: "_blank", rel: "noopener", textContent: "Open in Kinboard ↗" });
      document.body.append(whole);
      aim();
    }
    const changes = new MutationObserver(() => { waiting ||= setTimeout(() => { waiting = 0; complete(); }, 150); });
    changes.observe(document.body, { subtree: true, childList: true, attributes: true, attributeFilter: ["aria-hidden"] });
    // Arrow keys on a control must not rotate the view as well.
    for (const kind of ["keydown", "keyup"]) {
      document.body.addEventListener(kind, (event) => {
        if (event.key.startsWith("Arrow") && event.target.matches("input, textarea, [role]")) event.stopPropagation();
      });
    }
  });
  addEventListener("keydown", (event) => {
    if (!["Enter", " "].includes(event.key) || !(event.target instanceof Element) || !event.target.matches(FOLDER)) return;
    event.preventDefault();
    event.target.click();
  });

  async function copy(code) {
    try {
      await navigator.clipboard.writeText(code.textContent);
      return true;
    } catch {
      // Pages served over plain HTTP from another machine have no clipboard: select the text instead.
      getSelection().selectAllChildren(code);
      return document.execCommand("copy");
    }
  }

  addEventListener("click", async (event) => {
    const button = event.target instanceof Element ? event.target.closest("button[data-copy]") : null;
    const code = button?.closest("[data-copy-box]")?.querySelector("code");
    if (!code) return;
    const before = button.textContent;
    if (button.disabled) return;
    button.disabled = true;
    button.textContent = (await copy(code)) ? "Copied" : "Press Ctrl-C";
    setTimeout(() => { button.textContent = before; button.disabled = false; }, 1500);
  });
})();
