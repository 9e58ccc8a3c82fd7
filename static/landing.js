"use strict";
// All addresses are relative to this page, so the page works under any path prefix.

const here = new URL(".", document.baseURI).href;
const FAILED = "The service could not start whole: the viewer, or a process that computes for REST, is missing. See the log of the server.";
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
  for (;;) {
    const status = await readiness();
    if (status === "ready") break;
    if (status === "failed") show("failed", FAILED);
    else show("starting", status === "starting" ? "The viewer is starting…" : "Waiting for the server…");
    await new Promise((resolve) => setTimeout(resolve, status === "failed" ? 3000 : 400));
  }
  const viewer = document.createElement("iframe");
  viewer.src = "viewer/";
  viewer.name = "viewer";
  viewer.title = "Interactive 3-D view of the arm, with its controls";
  viewer.allow = "fullscreen; clipboard-write";
  byId("frame").append(viewer);
  show("ready", "This arm is yours alone");
  byId("placeholder").textContent = "Loading the viewer…";
}

function showMore() {
  const later = document.querySelectorAll("#cards [hidden]");
  for (const card of later) card.hidden = false;
  byId("more").hidden = true;
  later[0].querySelector("a").focus();
}

// The form to try REST

const method = () => byId("method").textContent;

function choose(example) {
  for (const each of document.querySelectorAll(".pick")) each.setAttribute("aria-pressed", String(each === example));
  byId("method").textContent = example.dataset.method;
  byId("path").value = example.dataset.path;
  byId("body").value = example.querySelector("code").textContent;
  byId("body").disabled = example.dataset.method === "GET";
  byId("body").placeholder = byId("body").disabled ? "A GET request has no body; its parameters are in the address." : "";
  say("", "");
  byId("answer").textContent = "Press Send to call this server.";
}

function say(kind, text) {
  byId("outcome").dataset.kind = kind;
  byId("outcome").textContent = text;
}

// Whatever was typed, the address stays on this server.
function address() {
  return here + byId("path").value.trim().replace(/^\/+/, "");
}

async function send() {
  byId("send").disabled = true;
  say("", "waiting…");
  const began = performance.now();
  try {
    const request = { method: method() };
    if (request.method === "POST") Object.assign(request, { headers: { "Content-Type": "application/json" }, body: byId("body").value });
    const answer = await fetch(address(), request);
    const text = await answer.text();
    const took = performance.now() - began;
    say(answer.ok ? "good" : "bad", `${answer.status} ${answer.statusText} · ${took.toFixed(0)} ms · ${text.length.toLocaleString("en")} characters`);
    byId("answer").textContent = pretty(text);
  } catch (error) {
    say("bad", "no answer");
    byId("answer").textContent = error.message;
  } finally {
    byId("send").disabled = false;
    byId("answer").scrollTo(0, 0);
  }
}

// JSON with each list of numbers on one line, as vectors and matrices are written.
function pretty(text) {
  const most = 60000;
  let shown = text;
  try {
    shown = JSON.stringify(JSON.parse(text), null, 2).replace(/\[\s*(-?[\d.][^[\]{}"]*?)\s*\]/g, (_, row) => `[${row.replace(/\s+/g, " ")}]`);
  } catch { /* not JSON: shown unchanged */ }
  return shown.length > most ? `${shown.slice(0, most)}\n… (truncated)` : shown;
}

function asCurl() {
  const quoted = (word) => `'${word.replaceAll("'", "'\\''")}'`;
  if (method() === "GET") return `curl -s ${quoted(address())}`;
  return `curl -s ${quoted(address())} \\\n  -H 'Content-Type: application/json' \\\n  -d ${quoted(byId("body").value)}`;
}

function prepareBox() {
  const examples = [...document.querySelectorAll(".pick")];
  for (const example of examples) example.addEventListener("click", () => choose(example));
  choose(examples[0]);
  byId("try").addEventListener("submit", (event) => { event.preventDefault(); send(); });
  byId("copy").addEventListener("click", async () => {
    const command = asCurl();
    const done = await copy(command);
    byId("copy").textContent = done ? "Copied" : "See below";
    if (!done) { byId("answer").textContent = command; getSelection().selectAllChildren(byId("answer")); }
    setTimeout(() => { byId("copy").textContent = "Copy as curl"; }, 1800);
  });
}

// Browsers deny clipboard access to pages served over plain http from another machine.
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

prepareBox();
byId("more").addEventListener("click", showMore);
byId("cards").addEventListener("click", (event) => { if (event.target.closest("a")) byId("viewer").scrollIntoView(); });
openViewerWhenReady();
