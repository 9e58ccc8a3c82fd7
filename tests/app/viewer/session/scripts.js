"use strict";
// Runs one of the page's scripts in a page with hardly anything in it, and prints what it has sent by the channel, what it
// keeps of this tab of the browser, and the address in the end.
// Usage: node scripts.js SCRIPT < steps.json
//
// A step is ["notice", name, value]: the service says this; or ["file", size, most]: a file of so many bytes is chosen.
const fs = require("node:fs");
const path = require("node:path");
const vm = require("node:vm");

const [sent, listeners] = [[], []];
const [notices, kept] = [new Map(), new Map()];
let address = "";
const window = {};
class Element { constructor(properties) { Object.assign(this, properties); } }
window.top = window;
function dispatchEvent(event) { for (const [type, act] of listeners) if (type === event.type) act(event); }
const page = vm.createContext({
  window, dispatchEvent, CustomEvent, URLSearchParams, Element,
  addEventListener: (type, act) => { listeners.push([type, act]); },
  document: { documentElement: { dataset: {}, toggleAttribute() {} }, getElementById: () => ({}) },
  location: { hash: "", search: "", pathname: "/viewer" },
  history: { state: null, replaceState: (state, title, to) => { address = to; } },
  sessionStorage: { getItem: (name) => kept.get(name) ?? null, setItem: (name, value) => { kept.set(name, value); } },
  localStorage: { getItem: () => null },
  viserPage: { watch() {}, openTab: (title) => title !== "Nowhere" },
  channel: {
    greet() {}, value: () => null,
    on: (name, act) => { notices.set(name, act); },
    send: (name, argument) => { sent.push(argument); },
  },
});
for (const file of [path.join(path.dirname(process.argv[2]), "dom.js"), process.argv[2]]) vm.runInContext(fs.readFileSync(file, "utf8"), page);
const steps = {
  notice: (name, value) => notices.get(name)(value),
  file(size, most) {
    const target = new Element({
      dataset: { most: String(most) },
      files: [{ name: "a.toml", size, text: async () => "x".repeat(size) }],
      closest: (selector) => ({ "[data-guide-file]": target, "[data-feature]": { dataset: { feature: "course" } } })[selector],
    });
    dispatchEvent({ type: "change", target });
  },
};
(async () => {
  for (const [step, ...rest] of JSON.parse(fs.readFileSync(0, "utf8"))) {
    steps[step](...rest);
    await new Promise(setImmediate);
  }
  console.log(JSON.stringify({ sent, address, kept: Object.fromEntries(kept) }));
})();
