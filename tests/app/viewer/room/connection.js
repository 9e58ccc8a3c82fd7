"use strict";
// Runs static/viser_page.js, channel.js and class_tab.js as the page of a student does, with a clock of its own, and prints
// what they ask the service and when they say "No connection". Usage: node connection.js FOLDER_OF_SCRIPTS < steps.json
//
// A step is ["wait", ms], ["sent"], ["heard"], ["closed"], ["cut"], ["mend"] or ["event", name]: of viser's connection
// something is sent, of the channel something is heard, or it is closed.
const fs = require("node:fs");
const path = require("node:path");
const vm = require("node:vm");

const BEFORE = 100; // ms until viser's page is looked into
let now = 1e6 - BEFORE;
let timers = [];
let cut = false;
const log = [];

class FakeDate extends Date { static now() { return now; } }
const setTimeout = (act, delay = 0, ...rest) => {
  const timer = { at: now + delay, act: () => act(...rest) };
  timers.push(timer);
  return timer;
};
const clearTimeout = (timer) => { timers = timers.filter((each) => each !== timer); };
const setInterval = (act, ms) => { setTimeout(() => { act(); setInterval(act, ms); }, ms); };
/** Let all that waits for promises run. */
const settle = () => new Promise((done) => setImmediate(done));
async function wait(ms) {
  const end = now + ms;
  for (;;) {
    await settle();
    const next = timers.filter(({ at }) => at <= end).sort((a, b) => a.at - b.at)[0];
    if (!next) break;
    timers = timers.filter((each) => each !== next);
    now = next.at;
    next.act();
  }
  now = end;
}

/** A class of the browser: its prototype has what viser_page.js replaces. */
const standIn = (name, ...properties) => {
  const made = { [name]: class {} }[name];
  for (const each of properties) Object.defineProperty(made.prototype, each, { configurable: true, get() { return ""; }, set() {} });
  return made;
};
class WebGL2RenderingContext { shaderSource() {} attachShader() {} linkProgram() {} }
let channelSocket = null;
class WebSocket extends EventTarget {
  constructor() {
    super();
    channelSocket = this;
    this.readyState = 0;
    if (!cut) setTimeout(() => { this.readyState = WebSocket.OPEN; this.dispatchEvent(new Event("open")); }, 1);
  }

  send(text) {
    if (text !== '["ask"]') return;
    log.push([now - 1e6, text]);
    if (!cut) setTimeout(hear, 5);
  }

  close() { this.readyState = 3; }
}
[WebSocket.CONNECTING, WebSocket.OPEN] = [0, 1];
const hear = () => channelSocket.dispatchEvent(Object.assign(new Event("message"), { data: '{"heard": 1}' }));
class Storage { getItem() { return null; } setItem() {} }

const page = new EventTarget();
let changed = () => {}; // the page has
const note = { textContent: "", hidden: true };
const bar = { dataset: {}, offsetHeight: 0 };
const root = { dataset: {}, style: { setProperty() {} }, toggleAttribute() {} };
const document = Object.assign(new EventTarget(), {
  hidden: false,
  documentElement: root,
  body: Object.assign(new EventTarget(), { append() {} }),
  querySelector: (selector) => (selector.startsWith("[data-class-bar]") ? bar
    : selector === ".kb-class-offline" ? note : selector === "[data-channel]" ? { dataset: { channel: "name" } } : selector.startsWith("canvas") ? {} : null),
  querySelectorAll: () => [],
});
const world = vm.createContext({
  document, setTimeout, clearTimeout, setInterval, WebSocket, performance: { now: () => now }, Date: FakeDate, WebGL2RenderingContext, Storage, Event, CustomEvent, URL, TextEncoder,
  Intl, navigator: { language: "en", languages: ["en"] }, history: { replaceState() {} }, location: new URL("http://127.0.0.1/viewer/"),
  addEventListener: page.addEventListener.bind(page), dispatchEvent: page.dispatchEvent.bind(page),
  localStorage: new Storage(), sessionStorage: new Storage(), ResizeObserver: class { observe() {} disconnect() {} },
  Node: standIn("Node", "textContent"), Element: standIn("Element", "innerHTML"), HTMLScriptElement: standIn("HTMLScriptElement"),
  HTMLInputElement: standIn("HTMLInputElement", "value"), Navigator: standIn("Navigator"), MutationObserver: class {
    constructor(act) { this.act = act; }
    observe(node) { if (node === root) changed = () => this.act([{ type: "childList" }]); }
  },
});
world.window = world;
for (const name of ["dom.js", "viser_page.js", "channel.js", "class_tab.js"]) {
  vm.runInContext(fs.readFileSync(path.join(process.argv[2], name), "utf8"), world, { filename: name });
}
Object.defineProperty(note, "textContent", { set(text) { this.text = text; log.push([now - 1e6, text]); }, get() { return this.text ?? ""; } });

world.__viserMutable = { sendMessage() {} };
changed();
const steps = {
  wait,
  sent: () => world.__viserMutable.sendMessage({ type: "GuiUpdateMessage", uuid: "a", updates: { value: 1 } }),
  heard: hear,
  closed: () => channelSocket.dispatchEvent(Object.assign(new Event("close"), { code: 1006 })),
  cut: () => { cut = true; },
  mend: () => { cut = false; },
  event: (name) => page.dispatchEvent(new Event(name)),
  hide: () => { document.hidden = true; },
};
(async () => {
  await wait(BEFORE);
  for (const [step, ...rest] of JSON.parse(fs.readFileSync(0, "utf8"))) await steps[step](...rest);
  await settle();
  console.log(JSON.stringify(log));
})();
