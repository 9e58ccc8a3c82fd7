"use strict";
// The button that starts a run, its progress, and its end. Addresses are relative, so any path prefix works.

const byId = (id) => document.getElementById(id);
const EVERY = 700; // ms between two questions how far the run is

function show(state, text) {
  byId("run-state").dataset.state = state;
  byId("run-state").textContent = text;
}

function showControls(running, share) {
  byId("run-start").hidden = running;
  byId("run-cancel").hidden = !running;
  byId("run-progress").hidden = !running;
  byId("run-progress").value = share;
}

// What the service says: a status, or the words of a refusal.
async function ask(method) {
  const request = { method, cache: "no-store" };
  if (method === "POST") Object.assign(request, { headers: { "Content-Type": "application/json" }, body: "{}" });
  const answer = await fetch("scoreboard/run", request);
  const said = await answer.json();
  if (!answer.ok) throw new Error(`${said.detail} ${said.hint}`);
  return said;
}

function elapsed(started) {
  const seconds = Math.max(0, Math.round(Date.now() / 1000 - started));
  return `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}

async function follow() {
  for (;;) {
    const status = await ask("GET");
    showControls(status.state === "running", status.share);
    if (status.state === "done") return location.reload();
    if (status.state !== "running") return show(status.state, status.words);
    show("running", `Running, ${Math.round(100 * status.share)} %: ${status.words} (${elapsed(status.started)})`);
    await new Promise((resolve) => setTimeout(resolve, EVERY));
  }
}

async function act(method, button) {
  button.disabled = true;
  try {
    await ask(method);
    if (method === "POST") await follow();
  } catch (error) {
    show("failed", error.message);
  } finally {
    button.disabled = false;
  }
}

byId("run-start").addEventListener("click", () => act("POST", byId("run-start")));
byId("run-cancel").addEventListener("click", () => act("DELETE", byId("run-cancel")));

// A run that is under way when the page is opened is followed; one that has ended is shown already.
ask("GET").then((status) => {
  if (status.state === "running") return follow();
  if (status.state === "failed" || status.state === "cancelled") show(status.state, status.words);
  return null;
}).catch((error) => show("failed", error.message));
