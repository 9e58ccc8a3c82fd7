"use strict";
// Runs static/lesson.js in a page with one typed question, and prints what stands in its field in the end of each case.
// Usage: node drafts.js FOLDER_OF_SCRIPTS < cases.json
//
// A case is a list of steps, a step ["ask", { lesson, arm, question, prompt, value, invalid }] or ["ask", { of, value }]: the page shows another question,
// of a lesson or an exercise; ["type", text], ["press", kind], ["answered", error] for all that was sent, or ["reload"].
const fs = require("node:fs");
const path = require("node:path");
const vm = require("node:vm");

/** An element of the page: enough of one for the selectors of the script. */
class Element {
  constructor(tag, attributes = {}, children = []) {
    Object.assign(this, { tag, attributes, children, parent: null, dataset: {}, defaultValue: attributes.value, value: attributes.value });
    this.textContent = attributes.text;
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("data-")) this.dataset[name.slice(5).replace(/-(.)/g, (_, letter) => letter.toUpperCase())] = value;
    }
    for (const child of children) child.parent = this;
  }

  matches(selector) {
    const options = selector.split(/,\s*(?![^(]*\))/);
    return options.some((one) => !/\s(?![^(]*\))/.test(one) && (one.match(/:\w+\([^)]*\)|[.]?[\w-]+|\[[^\]]+\]/g) ?? []).every((part) => this.#has(part)));
  }

  #has(part) {
    if (part.startsWith(":")) return this.matches(part.replace(/^:\w+\(|\)$/g, "")) !== part.startsWith(":not");
    if (part.startsWith(".")) return this.attributes.class === part.slice(1);
    if (!part.startsWith("[")) return this.tag === part;
    const [name, value] = part.slice(1, -1).replaceAll('"', "").split("=");
    return name in this.attributes && (value === undefined || this.attributes[name] === value);
  }

  closest(selector) { return this.matches(selector) ? this : this.parent?.closest(selector) ?? null; }

  querySelectorAll(selector) {
    const [, outer, inner] = /^([^\s(]+) (.+)$/.exec(selector) ?? [null, "", selector];
    return this.all().filter((each) => each.matches(inner) && (!outer || each.closest(outer)));
  }

  all() { return this.children.flatMap((child) => [child, ...child.all()]); }

  querySelector(selector) { return this.querySelectorAll(selector)[0] ?? null; }
  getClientRects() { return []; }
  dispatchEvent({ type }) { fire(type, this); }
}

const stored = new Map();
let listeners, watchers, waiting, world;
let root = new Element("body");
const fire = (type, target) => { for (const act of listeners.filter(([kind]) => kind === type)) act[1]({ target }); };
function load() {
  [listeners, watchers, waiting] = [[], [], []];
  const addEventListener = (type, act) => { listeners.push([type, act]); };
  world = vm.createContext({
    addEventListener, dispatchEvent: () => true, Element, Event, CustomEvent,
    document: { activeElement: null, querySelector: (each) => root.querySelector(each), querySelectorAll: (each) => root.querySelectorAll(each) },
    sessionStorage: { getItem: (name) => stored.get(name) ?? null, setItem: (name, value) => { stored.set(name, value); } },
    viserPage: { watch: (act) => { watchers.push(act); } },
    channel: { send: (message, argument, done = null) => { waiting.push(done); } },
  });
  for (const name of ["dom.js", "lesson.js"]) vm.runInContext(fs.readFileSync(path.join(process.argv[2], name), "utf8"), world, { filename: name });
}
let asked = {};
function ask(one) {
  asked = one;
  const cell = new Element("input", { "data-cell": "0", value: one.value ?? "", ...(one.invalid ? { "aria-invalid": "true" } : {}) });
  const button = (kind) => new Element("button", { "data-guide-do": kind });
  const block = new Element(
    "fieldset", { class: "kb-question", ...(one.question ? { "data-question": one.question } : {}) },
    [new Element("legend", { text: one.prompt }), new Element("span", { "data-row": "" }, [cell]), button("fields")],
  );
  root = new Element("body", {}, one.of
    ? [new Element("section", { "data-of": one.of, "data-feature": "exercises" }, [block])]
    : [new Element("section", { "data-of": `${one.lesson} ${one.arm}` }, [block, button("restart")])]);
  for (const act of watchers) act();
}
const cell = () => root.querySelector("[data-cell]");
const steps = {
  ask,
  type: (text) => { cell().value = text; fire("input", cell()); },
  press: (kind) => fire("click", root.querySelector(`[data-guide-do=${kind}]`)),
  answered: (error = "") => { for (const done of waiting.splice(0)) done?.(error, []); },
  reload: () => { load(); ask(asked); },
};
const last = [];
for (const given of JSON.parse(fs.readFileSync(0, "utf8"))) {
  stored.clear();
  load();
  for (const [step, ...rest] of given) steps[step](...rest);
  last.push(cell().value);
}
console.log(JSON.stringify(last));
