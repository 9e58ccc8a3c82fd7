"use strict";
// Runs in viser's page: the tab Program (app/viewer/tabs/program). It sends what is pressed, chosen and typed there, and
// shows the time that the server reports: on the slider, in the list, and as the cursor of the plots.
(() => {
  const LAST = 120; // ms: the last of many times is sent this long after it

  const part = (name) => document.querySelector(`[data-program="${name}"]`);
  const all = (selector) => [...document.querySelectorAll(`[data-program] ${selector}`)];
  const send = (key, value, done) => channel.send("feature", ["program", key, value], done);
  let serial = 0; // each press is a step of its own in the history
  const act = (name, value, ...rest) => send([name, ...rest, ++serial], value);
  const setText = (node, text) => { if (node && node.textContent !== text) node.textContent = text; };

  // Time

  let held = false; // the visitor holds the slider of time, or moves in a plot
  let wanted = null; // the time to be sent
  let busy = false;
  addEventListener("kinboard-connect", () => { busy = false; wanted = null; });

  /** Send the newest time, one at a time. */
  function push() {
    if (busy || wanted === null) return;
    const time = wanted;
    wanted = null;
    busy = true;
    const next = () => {
      clearTimeout(late);
      if (!busy) return;
      busy = false;
      push();
    };
    const late = setTimeout(next, 3000);
    send(["scrub"], time, next);
  }
  function goTo(time) {
    wanted = time;
    showTime(time);
    push();
  }

  function showTime(time) {
    const clock = part("clock");
    if (!clock) return;
    const duration = Number(clock.dataset.duration);
    const slider = document.querySelector("[data-program-time]");
    if (slider && !held) slider.value = String(time);
    setText(document.querySelector("[data-program-now]"), `${time.toFixed(2)} / ${duration.toFixed(2)} s`);
    const plot = document.querySelector("[data-program-plot]");
    const cursor = plot?.querySelector("[data-program-cursor]");
    if (!cursor) return;
    const [left, right] = [Number(plot.dataset.left), Number(plot.dataset.right)];
    cursor.hidden = !duration;
    cursor.style.left = `${left + (right - left) * Math.min(1, duration ? time / Number(plot.dataset.span) : 0)}%`;
  }

  function showClock() {
    const clock = part("clock");
    if (!clock) return;
    if (!held && wanted === null && !busy) showTime(Number(clock.dataset.time));
    const playing = clock.dataset.playing === "1";
    const button = document.querySelector("[data-program-play]");
    if (button) {
      setText(button, playing ? "❚❚" : "▶");
      if (button.ariaLabel !== (playing ? "Pause" : "Play")) button.ariaLabel = playing ? "Pause" : "Play";
    }
    for (const item of all("[data-program-item]")) item.classList.toggle("kb-here", item.dataset.programItem === clock.dataset.at);
  }

  addEventListener("input", (event) => {
    if (!event.target.matches?.("[data-program-time]")) return;
    held = true;
    goTo(Number(event.target.value));
  });
  addEventListener("change", (event) => { if (event.target.matches?.("[data-program-time]")) setTimeout(() => { held = false; }, LAST); });

  // A click in a plot goes there, and so does a drag.
  let plot = null;
  function pointAt(event) {
    const clock = part("clock");
    const box = plot.getBoundingClientRect();
    const [left, right] = [Number(plot.dataset.left), Number(plot.dataset.right)];
    const at = (100 * (event.clientX - box.left) / box.width - left) / (right - left);
    goTo(Math.min(Number(clock.dataset.duration), Number(plot.dataset.span) * Math.max(at, 0)));
  }
  addEventListener("pointerdown", (event) => {
    plot = event.button === 0 ? event.target.closest?.("[data-program-plot]") ?? null : null;
    if (!plot || event.pointerType === "touch") return; // a finger scrolls; its click comes below
    pointAt(event);
  }, true);
  addEventListener("pointermove", (event) => { if (plot && event.pointerType !== "touch") pointAt(event); }, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    addEventListener(kind, (event) => { if (event.pointerType !== "touch") plot = null; }, true);
  }

  // Buttons, choices, fields

  const OPENS = { postures: "postures", way: "way" }; // the part of the tab that a button opens, below the list
  let awaited = ""; // it comes into view as soon as it is complete
  function reveal() {
    const shown = awaited && part(awaited);
    if (!shown || !("ready" in shown.dataset)) return;
    awaited = "";
    shown.scrollIntoView({ block: "start" });
  }

  addEventListener("click", (event) => {
    const target = event.target instanceof Element ? event.target : document.body;
    const button = target.closest("[data-program-do]");
    if (button && button.ariaDisabled !== "true") {
      const index = button.dataset.index === undefined ? [] : [Number(button.dataset.index)];
      awaited = OPENS[button.dataset.programDo] ?? "";
      act(button.dataset.programDo, button.dataset.argument ?? null, ...index);
    }
    if (plot && event.pointerType === "touch") { pointAt(event); plot = null; }
  });
  addEventListener("change", (event) => {
    const target = event.target;
    const choice = target.closest?.("[data-program-choice]");
    if (choice) act(choice.dataset.programChoice, choice.type === "checkbox" ? choice.checked : "text" in choice.dataset ? choice.value : Number(choice.value));
    const field = target.closest?.("[data-program-field]");
    if (field) act("field", [field.dataset.programField, field.value], Number(field.dataset.index));
  });
  addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || !event.target.matches?.("input[data-program-field], input[data-text]")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    event.target.blur();
  }, true);

  function follow() {
    if (!part("clock")) return;
    reveal();
    showClock();
  }
  viserPage.watch(follow, { on: ["childList", "data-time", "data-playing", "data-at", "data-duration"] });
})();
