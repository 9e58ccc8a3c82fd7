"use strict";
// Every address is relative to this page, so that it works below any path prefix.

const here = new URL(".", document.baseURI).href;
const byId = (id) => document.getElementById(id);

function show(state, text) {
  byId("state").dataset.state = state;
  byId("state-text").textContent = text;
  byId("placeholder").textContent = text;
}

async function readiness() {
  try {
    const answer = await fetch("readyz", { cache: "no-store" });
    return (await answer.json()).status;
  } catch {
    return "unreachable";
  }
}

async function openViewerWhenReady() {
  const patient = performance.now() + 6000;
  for (;;) {
    const status = await readiness();
    if (status === "ready") break;
    if (status === "failed") return show("failed", "The viewer could not start; the server’s log says why. REST still answers.");
    const why = performance.now() > patient ? " The first start on a machine compiles its kernels: about a minute." : "";
    show("warming", status === "warming" ? "The viewer is warming up…" + why : "Waiting for the server…");
    await new Promise((resolve) => setTimeout(resolve, 400));
  }
  const viewer = document.createElement("iframe");
  viewer.src = "viewer/";
  viewer.title = "Interactive 3-D view of the arm, with its controls";
  viewer.allow = "fullscreen; clipboard-write";
  byId("frame").append(viewer);
  show("ready", "Your own arm: nobody else moves it");
  byId("placeholder").textContent = "Loading the viewer…";
}

function element(tag, text, className) {
  const node = document.createElement(tag);
  node.textContent = text;
  if (className) node.className = className;
  return node;
}

function card(robot) {
  const item = element("li", "", "card");
  const facts = element("ul", "", "facts");
  facts.append(element("li", `${robot.n} joints`), element("li", `${robot.convention} DH`));
  item.append(element("h3", robot.name), facts, element("p", robot.description), element("code", robot.id, "id"));
  return item;
}

async function fillCards() {
  const cards = byId("cards");
  try {
    const answer = await fetch("api/v1/robots");
    if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
    cards.replaceChildren(...(await answer.json()).robots.map(card));
  } catch (error) {
    cards.replaceChildren(element("li", `The robots could not be loaded: ${error.message}.`, "card quiet"));
  }
}

function fillExample(figure) {
  const code = figure.querySelector("code");
  const button = figure.querySelector("button");
  const command = `curl -s ${here}${code.dataset.path} \\\n  -H 'Content-Type: application/json' \\\n  -d '${code.textContent}'`;
  code.textContent = command;
  button.addEventListener("click", async () => {
    const done = await copy(command, code);
    button.textContent = done ? "Copied" : "Press Ctrl-C";
    setTimeout(() => { button.textContent = "Copy"; }, 1800);
  });
}

async function copy(text, node) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    // The clipboard is closed to pages served over plain http from another machine: select it for the visitor.
    getSelection().selectAllChildren(node);
    return false;
  }
}

document.querySelectorAll(".example").forEach(fillExample);
fillCards();
openViewerWhenReady();
