"use strict";
// Runs in viser's page: the table of the tab Robot (app/viewer/tabs/robot). It sends what is typed, cell by cell, and one
// message at a time, so that a slow answer delays only itself. What was typed since the last answer stays and is sent.
(() => {
  const { on } = dom;
  const PAUSE = 40; // ms after a key until a cell is sent
  const REST = 400; // the same where the arm on show has meshes: some megabytes are sent for each change
  const LEFT = 400; // ms without focus until the table is written again, so that a click on a button finds it
  const CELL = "[data-arm] [data-cell]";
  const ROW = "[data-arm] tr[data-row]";

  const part = (name) => document.querySelector(`[data-arm="${name}"]`);
  const doer = (name) => part("table").querySelector(`[data-arm-do="${name}"]`);
  const revision = () => Number(part("table")?.dataset.revision ?? 0);
  const anyWrong = () => document.querySelector('[data-arm^="wrong"]:not([hidden])') !== null;
  const send = (key, value, done) => channel.send("feature", ["robot", key, value], done);

  // Typed cells

  const typed = channel.newest("robot");
  function keyOf(name) {
    const [where, column] = name.split(" ");
    return column === undefined ? [name] : ["cell", /^\d+$/.test(where) ? Number(where) : where, column];
  }
  on("input", "[data-arm] input[data-cell]", (cell) => {
    typed.send(keyOf(cell.dataset.cell), [revision(), cell.value], part("files")?.hasAttribute("data-meshes") ? REST : PAUSE);
  });
  on("change", "[data-arm] select[data-cell]", (choice) => {
    typed.flush();
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
    const rows = dom.all(ROW);
    if (!rows.length) return;
    if (here < rows.length) coming = 0;
    if (!coming) here = Math.min(here, rows.length - 1);
    const at = Math.min(here, rows.length - 1);
    rows.forEach((row, i) => row.classList.toggle("kb-here", i === at));
    dom.set(document.querySelector("[data-arm-here]"), "textContent", `Row ${at + 1}`);
    const able = { up: at > 0, down: at < rows.length - 1, remove: rows.length > 1, add: true };
    for (const [name, yes] of Object.entries(able)) dom.set(doer(name), "ariaDisabled", String(!yes));
  }

  /** The answer to a new row comes with the table, or says that there is none. */
  function answeredRow(row) {
    if (coming === row) coming = 0;
    mark();
  }

  function change(action) {
    typed.flush();
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
  addEventListener("focusin", ({ target }) => {
    const row = dom.closest(target, ROW);
    if (row) { here = Number(row.dataset.row); mark(); }
    const cell = dom.closest(target, CELL);
    const name = cell ? `[data-cell="${cell.dataset.cell}"]` : null;
    clearTimeout(left);
    if (cell?.matches("input") && name !== focus) cell.select();
    if (focus && name !== focus) { typed.flush(); channel.send("released"); }
    if (focus && !cell) left = setTimeout(leave, LEFT);
    focus = name;
  });
  on("focusout", CELL, (cell, event) => {
    if (event.relatedTarget) return;
    // Browsers also report an element that they are about to remove; after that it is not connected.
    queueMicrotask(() => { if (cell.isConnected && document.activeElement === document.body) focus = null; });
    if (cell.isConnected) left = setTimeout(leave, LEFT);
  });
  function leave() {
    if (dom.closest(document.activeElement, CELL)) return;
    typed.flush();
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
    const line = dom.all("[data-cell]", row);
    if (right) return line[line.indexOf(cell) + right];
    const other = down > 0 ? row.nextElementSibling : row.previousElementSibling;
    return other?.querySelector(`[data-cell$=" ${cell.dataset.cell.split(" ")[1]}"]`);
  }

  on("keydown", CELL, (cell, event) => {
    const undo = (event.ctrlKey || event.metaKey) && !event.altKey && event.key.toLowerCase();
    const inTable = cell.closest("tr[data-row]") !== null;
    let to = null;
    if (undo === "z" || undo === "y") {
      typed.flush();
      if (anyWrong()) send(["discard"], null);
      else channel.send(undo === "y" || event.shiftKey ? "redo" : "undo");
    } else if (event.altKey && inTable && ["ArrowUp", "ArrowDown", "Enter"].includes(event.key)) {
      const action = { ArrowUp: "up", ArrowDown: "down", Enter: "add" }[event.key];
      if (doer(action).ariaDisabled !== "true") change(action);
    } else if (event.key === "Escape" && anyWrong()) {
      typed.flush();
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
    dom.set(part("table").querySelector("[data-arm-more]"), "textContent", words);
  }
  addEventListener("scroll", (event) => { if (event.target === scroller()) showMore(); }, true);
  const resized = new ResizeObserver(showMore);

  // Buttons

  on("click", "[data-arm-row]", (row) => { here = Number(row.dataset.armRow); mark(); });
  on("click", "[data-arm-do]:not([aria-disabled=true])", ({ dataset: { armDo: action, argument = null } }) => {
    if (["add", "up", "down", "remove"].includes(action)) change(action);
    else { typed.flush(); send([action], argument); }
  });
  on("click", "[data-arm-more]", () => {
    const box = scroller();
    box.scrollTo({ left: box.scrollLeft > 8 ? 0 : box.scrollWidth, behavior: "smooth" });
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
    restore();
    mark();
    resized.observe(scroller());
    showMore();
  });
})();
