"use strict";
// Runs in viser's page, before viser's own script: keys, typed values, and buttons of our own HTML. The server
// decides what they mean (app/viewer/session/events.py).
(() => {
  const HOLD = 600; // ms without a key until the next press counts as another step of the history
  const DECIMALS = 1e9;
  // Letters that move the target: axis and direction. The same places on QWERTY, QWERTZ and AZERTY keyboards.
  const MOVES = { KeyL: [0, 1], KeyJ: [0, -1], KeyI: [1, 1], KeyK: [1, -1], KeyO: [2, 1], KeyU: [2, -1] };
  const { on } = dom;
  const { type, thumbOf: thumb } = viserPage;
  const { send } = channel;

  // What can be undone

  function showHistory() {
    const labels = channel.value("history");
    for (const [k, name] of ["undo", "redo"].entries()) {
      const button = document.querySelector(`[data-send="${name}"]`);
      if (!labels || !button || button.shows === labels) continue; // the panel is built anew where a phone is turned
      button.shows = labels;
      const label = labels[k];
      button.ariaDisabled = String(!label);
      button.title = label ? `${name[0].toUpperCase() + name.slice(1)}: ${label} (${button.dataset.keys})` : `Nothing to ${name}`;
    }
  }
  channel.watch("history", showHistory);

  // Number fields beside sliders

  const fields = new Map(); // id of a slider → { unit, step, fine, page }
  const valueOf = (node, name = "now") => Number(node.getAttribute(`aria-value${name}`));

  function readFields() {
    for (const node of document.querySelectorAll("[data-fields]")) {
      if (node.read === node.dataset.fields) continue;
      node.read = node.dataset.fields;
      for (const [id, field] of Object.entries(JSON.parse(node.read))) fields.set(id, field);
    }
    for (const [id, field] of fields) {
      const line = document.getElementById(id)?.parentElement;
      if (line && !line.querySelector(".kb-field") && thumb(id)) addField(id, field, line);
    }
  }

  /** What was refused before no longer matters. */
  function accept() {
    for (const input of document.querySelectorAll('.kb-field input[aria-invalid="true"]')) {
      input.ariaInvalid = null;
      input.title = "";
      input.dispatchEvent(new Event("kinboard-accept"));
    }
  }
  addEventListener("pointerdown", ({ target }) => { if (viserPage.isSlider(target) || dom.closest(target, "canvas, button")) accept(); }, true);

  function addField(id, field, line) {
    // The keys for decimals of some phones have no minus.
    const keys = valueOf(thumb(id), "min") < 0 ? "text" : "decimal";
    const input = dom.element("input", { type: "text", inputMode: keys, autocomplete: "off", spellcheck: false });
    const unit = dom.element("span", { className: "kb-field-unit" }, field.unit);
    line.append(dom.element("span", { className: "kb-field" }, input, unit));
    line.dataset.kbLine = "";
    const slider = thumb(id);
    input.setAttribute("aria-label", `${viserPage.labelOf(slider)} (${field.unit})`);

    let edited = false;
    const show = () => { if (!edited) input.value = String(valueOf(slider)).replace("-", "−"); };
    const ask = () => {
      if (!edited) return;
      edited = false;
      send("field", [id, input.value], (error) => {
        input.ariaInvalid = error ? "true" : null;
        input.title = error; // and what was typed stays
        if (!error) { setTimeout(show, HOLD); accept(); }
      });
    };
    input.addEventListener("kinboard-accept", show);
    viserPage.watchValue(slider, () => { show(); if (!edited) input.ariaInvalid = null; });
    input.addEventListener("focus", () => input.select());
    input.addEventListener("input", () => { edited = true; input.ariaInvalid = null; });
    input.addEventListener("blur", ask);
    input.addEventListener("keydown", (event) => {
      const undone = edited;
      if (event.key === "Enter") {
        ask();
        input.select();
      } else if (event.key === "Escape") {
        edited = false;
        accept();
        show();
        input.select();
      } else if (["ArrowUp", "ArrowDown", "PageUp", "PageDown"].includes(event.key)) {
        ask();
        step(id, event);
      } else if (!historyKey(event) || undone) return;
      event.preventDefault();
    });
    show();
  }

  // Locks

  const LOCKED = "\u2060"; // see app/viewer/panel/joints.py
  function pressLocks() {
    for (const button of viserPage.buttons()) {
      const number = button.textContent.replace(LOCKED, "");
      const pressed = /^\d$/.test(number) ? String(button.textContent.startsWith(LOCKED)) : null;
      dom.set(button, "ariaPressed", pressed);
    }
  }

  // Feasible ranges stand below a slider, as wide as its track.

  const resized = new ResizeObserver(() => requestAnimationFrame(alignTracks));
  function alignTracks() {
    let track = null;
    for (const node of viserPage.tracksAnd(".kb-track")) {
      if (viserPage.isTrack(node)) { track = node; continue; }
      if (!track) continue;
      if (!track.sized) {
        track.sized = true;
        resized.observe(track);
      }
      const [bar, place] = [track.getBoundingClientRect(), node.parentElement.getBoundingClientRect()];
      if (!bar.width || !place.width) continue;
      const margin = `0 ${Math.round(place.right - bar.right)}px 0 ${Math.round(bar.left - place.left)}px`;
      if (node.style.margin !== margin) node.style.margin = margin;
    }
  }

  // Keys on sliders

  let last = { id: "", value: 0, at: 0 };
  let release = 0;

  function step(id, event) {
    const field = fields.get(id);
    const slider = thumb(id);
    const [least, most] = [valueOf(slider, "min"), valueOf(slider, "max")];
    const now = performance.now();
    const from = last.id === id && now - last.at < 300 ? last.value : valueOf(slider);
    const small = event.shiftKey ? field.fine : field.step;
    const to = {
      ArrowRight: from + small, ArrowUp: from + small, ArrowLeft: from - small, ArrowDown: from - small,
      PageUp: from + field.page, PageDown: from - field.page, Home: least, End: most,
    }[event.key];
    if (to === undefined) return false;
    if (!channel.mayAct()) return true; // no slider shows what the arm does not
    const value = Math.round(Math.min(Math.max(to, least), most) * DECIMALS) / DECIMALS;
    last = { id, value, at: now };
    const input = viserPage.fieldOf(id);
    if (input) type(input, String(value));
    clearTimeout(release);
    release = setTimeout(send, HOLD, "released");
    return true;
  }

  function sliderKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !viserPage.isThumb(event.target)) return false;
    const id = [...fields.keys()].find((key) => document.getElementById(key)?.contains(event.target));
    return id !== undefined && step(id, event);
  }

  // A drag is one step of the history.
  let slides = false; // the pointer was pressed on a slider
  addEventListener("pointerdown", (event) => { slides = viserPage.isSlider(event.target); }, true);
  for (const kind of ["pointerup", "pointercancel"]) addEventListener(kind, () => {
    if (slides || document.querySelector("[data-dragging]")) send("released");
  }, true);

  // History

  function historyKey(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || !channel.mayAct()) return false;
    const key = event.key.toLowerCase();
    if (key !== "z" && (key !== "y" || event.shiftKey)) return false;
    send(key === "y" || event.shiftKey ? "redo" : "undo");
    return true;
  }
  addEventListener("kinboard-travel", (event) => send("travel", event.detail));

  // The typed target

  const form = () => document.querySelector("[data-typed]");
  // The target's numbers where the tool has missed it, otherwise the tool's.
  const numbersOf = (row) => {
    const shown = [...row.querySelectorAll(".kb-number, data")].map((node) => node.textContent);
    return (row.dataset.target?.split(" ") ?? shown).map((text) => text.replace("−", "-"));
  };

  function openForm(kind) {
    const box = form();
    if (!box || !channel.mayAct()) return;
    if (!box.hidden) mark(false); // opened by another button
    box.hidden = false;
    box.dataset.typed = kind;
    for (const node of box.querySelectorAll("[data-for]")) node.hidden = !node.dataset.for.split(" ").includes(kind);
    const rows = kind === "pose" ? ["position", "angles"] : [kind];
    const input = box.querySelector("textarea");
    box.querySelector("[data-typed-frame]").value = "";
    input.value = rows.map((name) => document.querySelector(`:is(tr, p)[data-type="${name}"]`)) // a row that a question asks for is not there
      .map((row) => (row ? numbersOf(row).join("  ") : "")).join("\n").trim();
    input.setAttribute("aria-label", box.querySelector(`b[data-for="${kind}"]`).textContent);
    showError("");
    mark(true);
    input.focus();
    input.select();
    box.scrollIntoView({ block: "nearest" });
  }

  function closeForm() {
    form().hidden = true;
    mark(false);
    opener()?.focus();
  }

  /** The button that opens the form. */
  const opener = () => document.querySelector(form().dataset.typed === "pendant" ? "[data-pendant] button" : "button[data-type]");

  function mark(open) {
    const button = opener();
    if (button) button.ariaExpanded = String(open);
  }

  function showError(error, readings = []) {
    const box = form();
    const text = box.querySelector("textarea");
    box.querySelector("[data-typed-error]").textContent = error;
    box.querySelector("[data-typed-readings]").replaceChildren(...readings.map(([label, reading]) => {
      const button = dom.element("button", { type: "button" }, label);
      button.addEventListener("click", () => { text.value = reading; sendForm(); text.focus(); });
      return button;
    }));
    text.ariaInvalid = error ? "true" : null;
  }

  function sendForm() {
    const box = form();
    const frame = box.querySelector("[data-typed-frame]").value;
    send("target", [box.dataset.typed, box.querySelector("textarea").value, ...(frame ? [frame] : [])], (error, readings) => {
      if (error) showError(error, readings);
      else closeForm();
    });
  }

  on("click", "[data-send]:not([aria-disabled=true])", ({ dataset }) => send(dataset.send, dataset.argument));
  on("click", "[data-typed-send]", sendForm);
  on("click", "[data-typed-close]", closeForm);
  on("click", "[data-type]", (pressed, { target }) => {
    if (pressed.localName !== "button" && !getSelection().isCollapsed) return; // its numbers are being marked
    if (target.closest("button")?.ariaExpanded === "true") closeForm();
    else openForm(pressed.dataset.type);
  });

  on("input", "[data-typed] textarea", () => showError("")); // readings of another text are none of this one

  on("change", "[data-frame]", (choice) => {
    if (form() && !form().hidden) closeForm(); // its numbers are in the frame of before
    send("frame", choice.value);
  });
  on("change", "[data-typed-frame]", (choice) => {
    // From where the tool is, everything is zero; in the frame above, the present numbers.
    const kind = form().dataset.typed;
    const input = form().querySelector("textarea");
    if (choice.value) input.value = JSON.parse(form().dataset.none)[kind];
    else openForm(kind);
    input.focus();
  });

  // Jog: one step when a button is pressed, more while it is held

  const HELD = 400, AGAIN = 120; // ms until the second step, and between two
  const jogged = { "kb-pad-frame": null, "kb-pad-step": null }; // what the visitor has chosen
  let held = null; // the button
  let jogging = 0; // the timer of its next step
  const chosen = (name) => document.querySelector(`input[name="${name}"]:checked`)?.value;
  function jog(button) {
    const [axis, sign] = button.dataset.pad.split(" ").map(Number);
    send("jog", [chosen("kb-pad-frame"), axis, sign, Number(chosen("kb-pad-step"))]);
  }
  function jogAgain(pause) {
    jogging = setTimeout(() => {
      // On a page that is slow, the button may have been released meanwhile: such events come before the next frame.
      requestAnimationFrame(() => {
        if (!held?.isConnected) return;
        jog(held);
        jogAgain(AGAIN);
      });
    }, pause);
  }
  function stopJog() { // what was done until then is one step of the history
    clearTimeout(jogging);
    if (held) send("released");
    held = null;
  }
  on("pointerdown", "[data-pad]", (button, event) => {
    if (event.button !== 0) return;
    stopJog();
    held = button;
    jog(button);
    jogAgain(HELD);
  });
  for (const kind of ["pointerup", "pointercancel", "blur"]) addEventListener(kind, stopJog);
  on("contextmenu", "[data-pad]", (_, event) => event.preventDefault()); // a long touch
  on("click", "[data-pad]", (button, event) => {
    if (event.detail !== 0) return;
    jog(button); // by a key
    send("released");
  });
  addEventListener("change", (event) => { if (event.target.name in jogged) jogged[event.target.name] = event.target.value; });
  function keepJog() { // the pad is written again for another robot
    for (const [name, value] of Object.entries(jogged)) {
      const radio = value && document.querySelector(`input[name="${name}"][value="${value}"]`);
      if (radio && !radio.checked) radio.checked = true;
    }
  }

  // Keys of the page

  /** A key pressed while no control has the focus. */
  function sceneKey(event) {
    if (event.ctrlKey || event.metaKey || viserPage.isControl(event.target) || !channel.mayAct()) return false;
    const move = MOVES[event.code];
    if (move) send("nudge", [move[0], event.altKey, move[1], event.shiftKey]);
    else if (event.altKey || event.shiftKey || event.repeat) return false;
    else if (event.code === "KeyG") send("axes");
    else if (event.code === "KeyT") openForm("pose");
    else return false;
    return true;
  }

  function formKey(event) {
    if (!event.target.closest?.("[data-typed]")) return false;
    if (event.key === "Escape") closeForm();
    else if (event.key === "Enter" && !event.shiftKey && event.target.matches("textarea")) sendForm();
    else return false;
    return true;
  }

  // Before viser's own listeners.
  addEventListener("keydown", (event) => {
    const typing = event.target.matches?.("input, textarea");
    if (!(sliderKey(event) || formKey(event) || (!typing && historyKey(event)) || sceneKey(event))) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }, true);

  // With Shift, the gizmo moves in steps.
  let pulling = false;
  let snaps = false;
  function snap(wanted) {
    if (wanted === snaps) return;
    snaps = wanted;
    send("snap", snaps);
  }
  addEventListener("pointerdown", (event) => {
    pulling = event.target instanceof HTMLCanvasElement;
    if (pulling) snap(event.shiftKey);
  }, true);
  addEventListener("pointerup", () => { pulling = false; }, true);
  for (const kind of ["keydown", "keyup"]) {
    addEventListener(kind, (event) => { if (pulling && event.key === "Shift") snap(kind === "keydown"); }, true);
  }

  function follow() {
    showHistory();
    readFields();
    keepJog();
    pressLocks();
    alignTracks();
  }
  viserPage.watch(follow, { on: ["childList", "characterData"] });
})();
