"use strict";
// Runs in viser's page: the tab Program (app/viewer/tabs/program). It sends what is pressed, chosen and typed there, and
// shows the time that the server reports: on the slider, in the list, and as the cursor of the plots.
(() => {
  const { on, set } = dom;
  const LAST = 120; // ms: the last of many times is sent this long after it

  const part = (name) => document.querySelector(`[data-program="${name}"]`);
  let serial = 0; // each press is a step of its own in the history
  const act = (name, value, ...rest) => channel.send("feature", ["program", [name, ...rest, ++serial], value]);

  // Time

  const times = channel.newest("program");
  let held = false; // the visitor holds the slider of time, or moves in a plot

  function goTo(time) {
    times.send(["scrub"], time);
    showTime(time);
  }

  function showTime(time) {
    const clock = part("clock");
    if (!clock) return;
    const duration = Number(clock.dataset.duration);
    const slider = document.querySelector("[data-program-time]");
    if (slider && !held) slider.value = String(time);
    set(document.querySelector("[data-program-now]"), "textContent", `${time.toFixed(2)} / ${duration.toFixed(2)} s`);
    const plot = document.querySelector("[data-program-plot]");
    const cursor = plot?.querySelector("[data-program-cursor]");
    if (!cursor) return;
    const [left, right] = [Number(plot.dataset.left), Number(plot.dataset.right)];
    cursor.hidden = !duration;
    cursor.style.left = `${left + (right - left) * Math.min(1, duration ? time / Number(plot.dataset.span) : 0)}%`;
  }

  function showClock() {
    const clock = part("clock");
    if (times.rests() && !held) showTime(Number(clock.dataset.time));
    const playing = clock.dataset.playing === "1";
    const button = document.querySelector("[data-program-play]");
    set(button, "textContent", playing ? "❚❚" : "▶");
    set(button, "ariaLabel", playing ? "Pause" : "Play");
    for (const item of dom.all("[data-program] [data-program-item]")) item.classList.toggle("kb-here", item.dataset.programItem === clock.dataset.at);
  }

  on("input", "[data-program-time]", (slider) => {
    held = true;
    goTo(Number(slider.value));
  });
  on("change", "[data-program-time]", () => { setTimeout(() => { held = false; }, LAST); });

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
    plot = event.button === 0 ? dom.closest(event.target, "[data-program-plot]") : null;
    if (!plot || event.pointerType === "touch") return; // a finger scrolls; its click comes below
    pointAt(event);
  }, true);
  addEventListener("pointermove", (event) => { if (plot && event.pointerType !== "touch") pointAt(event); }, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    addEventListener(kind, (event) => { if (event.pointerType !== "touch") plot = null; }, true);
  }
  addEventListener("click", (event) => {
    if (plot && event.pointerType === "touch") { pointAt(event); plot = null; }
  });

  // Buttons, choices, fields

  const OPENS = { postures: "postures", way: "way" }; // the part of the tab that a button opens, below the list
  let awaited = ""; // it comes into view as soon as it is complete
  function reveal() {
    const shown = awaited && part(awaited);
    if (!shown || !("ready" in shown.dataset)) return;
    awaited = "";
    shown.scrollIntoView({ block: "start" });
  }

  on("click", "[data-program-do]:not([aria-disabled=true])", ({ dataset: { programDo: action, argument = null, index } }) => {
    awaited = OPENS[action] ?? "";
    act(action, argument, ...(index === undefined ? [] : [Number(index)]));
  });
  on("change", "[data-program-choice]", (choice) => {
    act(choice.dataset.programChoice, choice.type === "checkbox" ? choice.checked : "text" in choice.dataset ? choice.value : Number(choice.value));
  });
  on("change", "[data-program-field]", (field) => act("field", [field.dataset.programField, field.value], Number(field.dataset.index)));
  on("keydown", "input[data-program-field], input[data-text]", (field, event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    event.stopImmediatePropagation();
    field.blur();
  }, true);

  function follow() {
    if (!part("clock")) return;
    reveal();
    showClock();
  }
  viserPage.watch(follow, { on: ["childList", "data-time", "data-playing", "data-at", "data-duration"] });
})();
