"use strict";
// Runs before viser's own script, in its page. It gives the page a memory of its own tab: the state that the server
// tells is kept in the address and in sessionStorage, and told again to whoever asks after a reload or a lost
// connection. The server reaches it through viser's access to localStorage, which all tabs of a browser share: our
// one item is taken out of there.
(() => {
  const ITEM = "viser-user:kinboard";
  const STATE = "kinboard-state";
  const TAB = "kinboard-tab";
  const { getItem, setItem } = Storage.prototype;
  const replaceState = history.replaceState.bind(history);

  // A browser may forbid storage; then the address alone remembers.
  const recall = (name) => { try { return getItem.call(sessionStorage, name); } catch { return null; } };
  const keep = (name, value) => { try { setItem.call(sessionStorage, name, value); } catch { /* see above */ } };

  const told = new URLSearchParams(location.hash.slice(1));
  const shared = told.has("s");
  let state = told.get("s") ?? recall(STATE) ?? "";
  let tab = told.get("tab") ?? (shared ? "" : recall(TAB)) ?? "";
  if (shared) { keep(STATE, state); keep(TAB, tab); }

  // Neither a foreign server nor a recording, whatever the address says.
  const query = new URLSearchParams(location.search);
  query.delete("websocket");
  query.delete("playbackPath");
  const page = location.pathname + (query.size ? `?${query}` : "");
  // viser derives the websocket's address from the page's, where a fragment is an error: it comes back below.
  replaceState(null, "", page);

  function show() {
    const parts = [];
    if (state) parts.push(`s=${state}`);
    if (tab) parts.push(`tab=${encodeURIComponent(tab)}`);
    replaceState(null, "", parts.length ? `${page}#${parts.join("&")}` : page);
  }

  // viser would write the websocket's address into the page's, and a shared link would carry it elsewhere.
  history.replaceState = show;
  addEventListener("hashchange", () => location.reload());

  Storage.prototype.getItem = function (name) {
    if (name !== ITEM) return getItem.call(this, name);
    openTab(performance.now() + 30000);
    return JSON.stringify({ address: location.origin + location.pathname.replace(/viewer\/?$/, ""), state });
  };
  Storage.prototype.setItem = function (name, value) {
    if (name !== ITEM) return setItem.call(this, name, value);
    state = value;
    keep(STATE, state);
    show();
  };

  const tabs = () => [...document.querySelectorAll('[role="tab"]')];
  const label = (node) => node.textContent.trim();

  // The controls come some time after the question for the state; they open at the first tab.
  function openTab(until) {
    if (!tab || performance.now() > until) return;
    const wanted = tabs().find((node) => label(node) === tab);
    if (!wanted || document.querySelector("[data-status]") === null) setTimeout(openTab, 100, until);
    else if (wanted.getAttribute("aria-selected") !== "true") {
      // The panel's own tabs listen to the keyboard and to dragging, those of a phone's sheet to clicks.
      wanted.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true, cancelable: true }));
      wanted.click();
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

  // What viser leaves without a name or out of the keyboard's reach.

  const NAMELESS = '[role="slider"][aria-label=""], [role="progressbar"]:not([aria-label]), input:not([type="hidden"]):not([aria-label])';
  const FOLDER = ".mantine-Paper-root > .mantine-Paper-root:has(> .tabler-icon-chevron-up, > .tabler-icon-chevron-down)";
  const name = (node, text) => { if (node && text) node.setAttribute("aria-label", text); };

  /** The label of the line of the panel that a control is in: the nearest box around both has only that one. */
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
    const changes = new MutationObserver(() => { waiting ||= setTimeout(() => { waiting = 0; complete(); }, 150); });
    changes.observe(document.body, { subtree: true, childList: true, attributes: true, attributeFilter: ["aria-hidden"] });
    // A control's arrow keys are its own: viser would also turn the view by them.
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
      // Pages served over plain http from another machine have no clipboard: select the text for the visitor.
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
