"use strict";
// Runs in viser's page: what a screen reader gets of the picture. The page has a main part, the scene has a name and a
// description, and what has changed in it is said once the arm has come to rest. It repeats in words what the panel
// shows: what a question hides there, it hides here too. Other scripts have a text said with the event kinboard-say.
(() => {
  const REST = 1000; // ms without a change until it is said
  const READY = "Ready"; // a title that is no news: app/viewer/panel/status.py
  const description = document.getElementById("kb-scene");
  const spoken = document.getElementById("kb-says");
  const textOf = (selector) => document.querySelector(selector)?.textContent.trim() ?? "";

  function tool() {
    const row = document.querySelector(".kb-readout tr[data-type=position]");
    if (!row) return ""; // a question asks for it
    const names = row.querySelector("th").textContent.split(" ");
    const numbers = [...row.querySelectorAll("td span")].map((node, i) => `${names[i]} ${node.textContent}`);
    const frame = textOf("#kb-frame option:checked");
    const unit = textOf(".kb-readout tr[data-type=position] .kb-unit");
    return `tool at ${numbers.join(", ")} ${unit}${frame && frame !== "world" ? ` in the frame ${frame}` : ""}`;
  }

  const sentence = (text) => text[0].toUpperCase() + text.slice(1) + (/[.!?…]$/.test(text) ? "" : ".");
  function status() {
    const title = textOf("[data-status] b");
    const detail = textOf("[data-status] .kb-callout-detail");
    return title === READY ? "" : [title, detail].filter(Boolean).map(sentence).join(" ");
  }

  /** What there is to say, part by part. */
  const parts = () => [
    viserPage.valueOf("Robot"), textOf("[data-branch]").replace(/^now: /, "").replaceAll(" · ", ", "), tool(), status(),
  ].map((text) => text.replace(/\s+/g, " "));
  const join = (texts) => {
    const [what, news] = [texts.slice(0, 3).filter(Boolean).join(", "), texts[3]];
    return [what && sentence(what), news].filter(Boolean).join(" ");
  };

  let said = null; // the parts that were said last; null: the page has just opened
  let now = [], timer = 0, held = false;
  function follow() {
    name();
    const next = parts();
    if (next.join() === now.join() || !document.querySelector("[data-status]")) return;
    now = next;
    later();
  }
  function later() {
    clearTimeout(timer);
    if (!held) timer = setTimeout(rest, REST);
  }
  function rest() {
    const news = now.map((text, i) => (text === said?.[i] ? "" : text));
    description.textContent = join(now);
    if (said && news.some(Boolean)) say(join(news));
    said = now;
  }
  const say = (text) => { spoken.textContent = text; };
  addEventListener("kinboard-say", (event) => say(event.detail));

  // Nothing is said while something is dragged.
  addEventListener("pointerdown", () => { held = true; clearTimeout(timer); }, true);
  for (const kind of ["pointerup", "pointercancel"]) addEventListener(kind, () => { held = false; later(); }, true);

  function name() {
    const page = viserPage.page();
    if (page && page.role !== "main") page.role = "main";
    const scene = viserPage.scene();
    if (!scene || scene.role) return;
    scene.role = "img";
    scene.ariaLabel = "Scene with the robot arm";
    scene.setAttribute("aria-describedby", description.id);
  }
  viserPage.watch(follow, { on: ["childList", "characterData"], delay: 200 });
})();
