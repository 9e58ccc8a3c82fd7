"use strict";
// Runs in viser's page, before viser's own script. It stores the page's state per tab: the state that the server sends
// is kept in the URL and in sessionStorage, and returned to the server after a reload or a lost connection, as the first
// message of the page's channel. Each state has an entry in the browser's history: Back returns to the one before.
(() => {
  const LONGEST_STATE = 16000; // characters
  const LEFT_OFF = "kinboard-left-off";
  const STATE = "kinboard-state";
  const TAB = "kinboard-tab";
  const embedded = window !== window.top; // whose history belongs to the outer page

  const fragment = new URLSearchParams(location.hash.slice(1));
  const shared = fragment.has("s");
  let state = fragment.get("s") ?? dom.tab.get(STATE) ?? "";
  // Where the last page with a lesson was, if this one begins anew.
  const leftOff = state || embedded ? "" : dom.browser.get(LEFT_OFF) ?? "";
  document.documentElement.toggleAttribute("data-kb-left-off", leftOff !== "");
  dom.on("click", "[data-left-off]", () => { location.hash = `s=${leftOff}&tab=Learn`; }); // which loads the page anew
  let tab = fragment.get("tab") ?? (shared ? "" : dom.tab.get(TAB)) ?? "";
  if (shared) { dom.tab.set(STATE, state); dom.tab.set(TAB, tab); }

  // Never connect to another server or play a recording, whatever the URL contains.
  const query = new URLSearchParams(location.search);
  query.delete("websocket");
  query.delete("playbackPath");
  const page = location.pathname + (query.size ? `?${query}` : "");
  // ?embed=1: the scene alone; ?embed=panel: with a small panel. Both have a link to the whole page.
  const mode = { 1: "scene", panel: "panel" }[query.get("embed")] ?? "";
  if (mode) document.documentElement.dataset.kbEmbed = mode;
  let at = history.state?.kinboard ?? 0; // the present entry
  let silent = shared && !mode && history.state?.kinboard === undefined; // a link that may not say which tab to open
  const loaded = at;
  const trail = []; // the state of each entry, as far as known
  trail[at] = state;
  // viser derives the websocket's address from the page's, where a fragment is an error, and writes it into the page's:
  // `show` restores that.
  history.replaceState({ kinboard: at }, "", page);

  function address() {
    const parts = [];
    if (state) parts.push(`s=${state}`);
    if (tab) parts.push(`tab=${encodeURIComponent(tab)}`);
    return parts.length ? `${page}#${parts.join("&")}` : page;
  }
  const whole = document.getElementById("kb-open"); // the link to the whole page
  whole.hidden = !mode;
  function show() {
    trail[at] = state;
    history.replaceState({ kinboard: at }, "", address());
    whole.href = location.pathname + (state ? `#s=${state}` : "");
  }

  function add() {
    if (embedded) { show(); return; }
    history.pushState({ kinboard: ++at }, "", address());
    trail.length = at;
    trail[at] = state;
  }

  // The server may write the state with which this page was loaded in other words.
  const start = () => channel.value("start")?.[0] ?? "";
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
    dom.tab.set(STATE, state);
    show(); // the tab may be another one now
    if (!expected) dispatchEvent(new CustomEvent("kinboard-travel", { detail: at === loaded ? start() || state : state }));
    expected = false;
  });

  viserPage.watch(() => { if (location.search.includes("websocket=")) show(); });
  addEventListener("hashchange", () => { if (history.state?.kinboard === undefined) location.reload(); });

  channel.greet(() => {
    openTab(performance.now() + 30000);
    show();
    return {
      // A longer state cannot be one, and the service says so.
      address: location.origin + location.pathname.replace(/viewer\/?$/, ""),
      state: state.slice(0, LONGEST_STATE + 1),
      text: document.documentElement.dataset.kbText,
      embedded: mode,
      shown: query.get("shown") ?? "",
      robot: query.get("robot") ?? "",
      zone: -new Date().getTimezoneOffset(),
      dark: matchMedia("(prefers-color-scheme: dark)").matches,
    };
  });
  // A state of the page: a new one, the same from another viewpoint, or one that has an entry.
  for (const [kind, then] of [["state", add], ["state-replace", show], ["state-return", goBack]]) {
    channel.on(kind, (value) => { state = value; dom.tab.set(STATE, state); then(); });
  }
  channel.on("tab", (title) => { // of a command of the palette
    if (viserPage.openTab(title)) dispatchEvent(new CustomEvent("kinboard-tab", { detail: title }));
  });
  // The same state, for the next page of this browser.
  channel.on("state-last", (value) => { if (!embedded) dom.browser.set(LEFT_OFF, value); });

  // The controls appear some time after the state was requested, with the first tab open.
  function openTab(until) {
    if ((!tab && !silent) || performance.now() > until) return;
    const ready = document.querySelector("[data-status]") !== null;
    if (!tab && ready && start()) { // then the one of what it shows
      silent = false;
      const [, opened] = channel.value("start");
      if (opened) dispatchEvent(new CustomEvent("kinboard-tab", { detail: opened }));
    }
    if (!ready || (tab ? !viserPage.openTab(tab) : silent)) setTimeout(openTab, 100, until);
  }

  function noteTab(event) {
    const strip = viserPage.stripAt(event.target);
    if (!strip || !event.isTrusted) return;
    setTimeout(() => {
      const title = viserPage.openTitleIn(strip);
      if (title) dispatchEvent(new CustomEvent("kinboard-tab", { detail: title }));
    }, 100);
  }
  // A tab that was opened, by the visitor or for them.
  addEventListener("kinboard-tab", (event) => {
    tab = event.detail;
    dom.tab.set(TAB, tab);
    show();
  });
  addEventListener("click", noteTab);
  addEventListener("keyup", noteTab);

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

  dom.on("click", "button[data-copy]", async (button) => {
    const code = button.closest("[data-copy-box]")?.querySelector("code");
    if (!code || button.disabled) return;
    const before = button.textContent;
    button.disabled = true;
    button.textContent = (await copy(code)) ? "Copied" : "Press Ctrl-C";
    setTimeout(() => { button.textContent = before; button.disabled = false; }, 1500);
  });
})();
