"use strict";
// Runs in viser's page: the table of the tab Robot (app/viewer/tabs/robot). It sends what is typed, cell by cell, and one
// message at a time, so that a slow answer delays only itself. What was typed since the last answer stays and is sent.
(() => {
  const PAUSE = 40; // ms after a key until a cell is sent
  const REST = 400; // the same where the arm on show has meshes: some megabytes are sent for each change
  const PATIENCE = 3000; // ms for an answer, then the next message is sent
  const LEFT = 400; // ms without focus until the table is written again, so that a click on a button finds it

  const part = (name) => document.querySelector(`[data-arm="${name}"]`);
  const revision = () => Number(part("table")?.dataset.revision ?? 0);
  const anyWrong = () => document.querySelector('[data-arm^="wrong"]:not([hidden])') !== null;
  const send = (key, value, done) => channel.send("feature", ["robot", key, value], done);

  // Typed cells

  const typed = new Map(); // cell → revision and text, not sent yet
  let sent = null; // the same of the message that waits for its answer
  let busy = 0; // the timer of the message that waits for its answer
  let pause = 0; // the timer of `push`
  let due = 0; // when it ends
  function answered() { clearTimeout(busy); busy = 0; sent = null; }
  addEventListener("kinboard-connect", () => { typed.clear(); answered(); });

  function keyOf(name) {
    const [where, column] = name.split(" ");
    return column === undefined ? [name] : ["cell", /^\d+$/.test(where) ? Number(where) : where, column];
  }

  function push() {
    clearTimeout(pause);
    if (busy || !typed.size) return;
    const [[name, value]] = typed;
    typed.delete(name);
    sent = [name, value];
    const next = () => { answered(); pushLater(); };
    busy = setTimeout(next, PATIENCE);
    send(keyOf(name), value, next);
  }

  /** Send what was typed, once typing has rested. */
  function pushLater() {
    clearTimeout(pause);
    pause = setTimeout(push, Math.max(0, due - performance.now()));
  }

  /** Write what the server has not read yet into fields that it has written. Rows that moved are others: theirs is gone. */
  function keepTyped() {
    for (const [name, [rows, text]] of new Map([...(sent ? [sent] : []), ...typed])) {
      const cell = document.querySelector(`[data-arm] input[data-cell="${name}"]`);
      const same = rows === revision() || !/^\d/.test(name);
      if (!same) typed.delete(name);
      else if (cell && cell.value !== text) cell.value = text;
    }
  }

  /** Send everything that was typed, before something else is sent. */
  function flush() {
    clearTimeout(pause);
    for (const [name, value] of typed) send(keyOf(name), value);
    typed.clear();
  }

  addEventListener("input", (event) => {
    const cell = event.target.closest?.("[data-arm] input[data-cell]");
    if (!cell) return;
    typed.set(cell.dataset.cell, [revision(), cell.value]);
    due = performance.now() + (part("files")?.hasAttribute("data-meshes") ? REST : PAUSE);
    pushLater();
  });
  addEventListener("change", (event) => {
    const choice = event.target.closest?.("[data-arm] select[data-cell]");
    if (!choice) return;
    flush();
    const key = keyOf(choice.dataset.cell);
    if (key[0] === "start") coming = 0; // the other arm has rows of its own
    send(key, key[0] === "cell" ? [revision(), choice.value] : choice.value);
  });

  // The row for the buttons below the table

  let here = 0; // may be a row that is still to come
  let added = 0; // new rows that were asked for
  let coming = 0; // which of these is the last that is still to come; 0: none
  addEventListener("kinboard-connect", () => { coming = 0; });
  function mark() {
    const rows = [...document.querySelectorAll("[data-arm] tr[data-row]")];
    if (!rows.length) return;
    if (here < rows.length) coming = 0;
    if (!coming) here = Math.min(here, rows.length - 1);
    const at = Math.min(here, rows.length - 1);
    rows.forEach((row, i) => row.classList.toggle("kb-here", i === at));
    const label = document.querySelector("[data-arm-here]");
    if (label.textContent !== `Row ${at + 1}`) label.textContent = `Row ${at + 1}`;
    const able = { up: at > 0, down: at < rows.length - 1, remove: rows.length > 1, add: true };
    for (const [name, yes] of Object.entries(able)) {
      const button = part("table").querySelector(`[data-arm-do="${name}"]`);
      if (button.ariaDisabled !== String(!yes)) button.ariaDisabled = String(!yes);
    }
  }

  /** The answer to a new row comes with the table, or says that there is none. */
  function answeredRow(row) {
    if (coming === row) coming = 0;
    mark();
  }

  function change(action) {
    flush();
    if (action === "add") coming = ++added;
    const row = added;
    send(["row", action, here], null, action === "add" ? () => answeredRow(row) : null);
    here += { add: 1, up: -1, down: 1 }[action] ?? 0;
    focus = focus?.replace(/^(\[data-cell=")\d+/, `$1${here}`) ?? null;
    moves = focus !== null;
  }

  // Focus: it follows a row that moves

  let focus = null; // a selector of the field that has it
  let moves = false; // its row moves
  let left = 0;
  addEventListener("focusin", (event) => {
    const row = event.target.closest?.("[data-arm] tr[data-row]");
    if (row) { here = Number(row.dataset.row); mark(); }
    const cell = event.target.closest?.("[data-arm] [data-cell]");
    const name = cell ? `[data-cell="${cell.dataset.cell}"]` : null;
    clearTimeout(left);
    if (cell?.matches("input") && name !== focus) cell.select();
    if (focus && name !== focus) { flush(); channel.send("released"); }
    if (focus && !cell) left = setTimeout(leave, LEFT);
    focus = name;
  });
  addEventListener("focusout", (event) => {
    const target = event.target;
    if (event.relatedTarget || !target.closest?.("[data-arm] [data-cell]")) return;
    // Browsers also report an element that they are about to remove; after that it is not connected.
    queueMicrotask(() => { if (target.isConnected && document.activeElement === document.body) focus = null; });
    if (target.isConnected) left = setTimeout(leave, LEFT);
  });
  function leave() {
    if (document.activeElement?.closest("[data-arm] [data-cell]")) return;
    flush();
    send(["left"], null);
  }
  function restore() {
    const cell = focus && moves ? document.querySelector(`[data-arm] ${focus}`) : null;
    if (!cell) return;
    moves = false;
    cell.focus({ preventScroll: true });
  }

  // Keys

  function neighbour(cell, down, right) {
    const row = cell.closest("tr");
    if (!row) return undefined;
    const line = [...row.querySelectorAll("[data-cell]")];
    if (right) return line[line.indexOf(cell) + right];
    const other = down > 0 ? row.nextElementSibling : row.previousElementSibling;
    return other?.querySelector(`[data-cell$=" ${cell.dataset.cell.split(" ")[1]}"]`);
  }

  addEventListener("keydown", (event) => {
    const cell = event.target.closest?.("[data-arm] [data-cell]");
    if (!cell) return;
    const undo = (event.ctrlKey || event.metaKey) && !event.altKey && event.key.toLowerCase();
    const inTable = cell.closest("tr[data-row]") !== null;
    let to = null;
    if (undo === "z" || undo === "y") {
      flush();
      if (anyWrong()) send(["discard"], null);
      else channel.send(undo === "y" || event.shiftKey ? "redo" : "undo");
    } else if (event.altKey && inTable && ["ArrowUp", "ArrowDown", "Enter"].includes(event.key)) {
      const action = { ArrowUp: "up", ArrowDown: "down", Enter: "add" }[event.key];
      if (part("table").querySelector(`[data-arm-do="${action}"]`).ariaDisabled !== "true") change(action);
    } else if (event.key === "Escape" && anyWrong()) {
      flush();
      send(["discard"], null);
    } else if (!cell.matches("input") || event.ctrlKey || event.metaKey || event.altKey) return;
    else if (event.key === "Enter" && !cell.closest("tr")) cell.blur();
    else if (event.key === "Enter") to = neighbour(cell, 0, event.shiftKey ? -1 : 1) ?? neighbour(cell, event.shiftKey ? -1 : 1, 0) ?? cell;
    else if (event.key === "ArrowDown") to = neighbour(cell, 1, 0);
    else if (event.key === "ArrowUp") to = neighbour(cell, -1, 0);
    else if (event.key === "ArrowRight" && cell.selectionStart === cell.value.length) to = neighbour(cell, 0, 1);
    else if (event.key === "ArrowLeft" && cell.selectionEnd === 0) to = neighbour(cell, 0, -1);
    else return;
    if (event.key.startsWith("Arrow") && !event.altKey && !to) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    to?.focus();
  }, true);

  // Sideways: the button says what is there, and is gone where everything is in sight

  const scroller = () => part("table")?.querySelector(".kb-arm-scroll");
  function showMore() {
    const box = scroller();
    if (!box?.clientWidth) return;
    box.classList.toggle("kb-arm-whole", box.scrollWidth <= box.clientWidth + 1);
    const words = box.scrollLeft > 8 ? "‹ Numbers" : "Limits ›";
    const button = part("table").querySelector("[data-arm-more]");
    if (button.textContent !== words) button.textContent = words;
  }
  addEventListener("scroll", (event) => { if (event.target === scroller()) showMore(); }, true);
  const resized = new ResizeObserver(showMore);

  // Buttons

  addEventListener("click", (event) => {
    const target = event.target instanceof Element ? event.target : document.body;
    const row = target.closest("[data-arm-row]");
    if (row) { here = Number(row.dataset.armRow); mark(); }
    const button = target.closest("[data-arm-do]");
    if (button && button.ariaDisabled !== "true") {
      const action = button.dataset.armDo;
      if (["add", "up", "down", "remove"].includes(action)) change(action);
      else { flush(); send([action], button.dataset.argument ?? null); }
    }
    if (target.closest("[data-arm-more]")) {
      const box = scroller();
      box.scrollTo({ left: box.scrollLeft > 8 ? 0 : box.scrollWidth, behavior: "smooth" });
    }
  });

  // A file with several ends or robots asks which. That stands below the table, far from where a file was dropped.
  let asked = null; // the file whose choice was shown
  function showChoice() {
    const choice = document.querySelector('select:is([data-cell="tip"], [data-cell="urdf"])');
    const file = choice?.dataset.file ?? null;
    if (choice && file !== asked) requestAnimationFrame(() => choice.scrollIntoView({ block: "center" }));
    asked = file;
  }

  viserPage.watch(showChoice);
  viserPage.watch(() => {
    if (!part("table")) return;
    keepTyped();
    restore();
    mark();
    resized.observe(scroller());
    showMore();
  });
})();
