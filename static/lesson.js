"use strict";
// Runs in viser's page: the steps of a lesson (app/viewer/lessons/guide), the exercises (app/viewer/exercises) and courses
// (app/viewer/courses). It sends what is pressed and typed there.
(() => {
  const { on } = dom;
  let serial = 0; // each press is a step of its own in the history
  const ANSWERS = ["answer", "fields", "posture", "place"];
  // A block with data-feature belongs to that lesson, others to the block that all lessons have.
  function send(node, kind, value, ...rest) {
    const feature = node.closest("[data-feature]")?.dataset.feature ?? "guide";
    // In a room, static/class_tab.js sends answers, and again until they have arrived.
    const detail = { kind, value };
    if (feature === "exercises" && ANSWERS.includes(kind)
      && !dispatchEvent(new CustomEvent("kinboard-answer", { detail, cancelable: true }))) return;
    expectWords(node, kind);
    channel.send("feature", [feature, [kind, ...rest, ++serial], value], kind === "fields" ? forgetting(node) : null);
  }

  function press(button) {
    const { guideDo: kind, questionKey: key, argument } = button.dataset;
    if (kind === "restart" && !button.closest("[data-feature]")) keepDrafts(drafts.filter(([each]) => !each.startsWith(`${placeOf(button)} `)));
    if (kind === "check") check(button);
    else if (kind === "fields") send(button, kind, cells(button.closest("fieldset")), ...(key === undefined ? [] : [key]));
    else send(button, kind, argument === undefined ? null : Number(argument), ...(key === undefined ? [] : [key]));
  }
  // The typed cells of an exercise, row by row.
  const cells = (block) => dom.all("[data-row]", block).map((row) => dom.all("[data-cell]", row).map((cell) => cell.value));
  // All fields of a block together.
  function check(node) {
    const fields = dom.all("input[data-guide-field]", node.closest("[data-feature]"));
    send(node, "check", Object.fromEntries(fields.map((field) => [field.dataset.guideField, field.value])));
  }

  on("click", "[data-guide-do]:not([aria-disabled=true])", press);
  // Texts and choices that are sent when they have changed, and files.
  on("change", "[data-guide-change]", (field) => send(field, "set", field.value, field.dataset.guideChange));
  on("change", "[data-guide-file]", upload);
  on("click", "[data-guide-open]", (button) => button.parentElement.querySelector("[data-guide-file]").click());
  // A click in a map: where, as shares of its width and its height, from the left and from below.
  on("click", "[data-guide-map]", (map, { clientX, clientY }) => {
    const { left, bottom, width, height } = map.querySelector("image").getBoundingClientRect();
    const [x, y] = [(clientX - left) / width, (bottom - clientY) / height];
    if (x >= 0 && x <= 1 && y >= 0 && y <= 1) send(map, "map", [x, y]);
  });
  async function upload(input) {
    const file = input.files[0];
    input.value = "";
    if (file) send(input, "upload", [file.name, file.size > Number(input.dataset.most) ? null : await file.text()]);
  }
  addEventListener("keydown", (event) => {
    if (event.key === "Enter" && event.target.matches?.("input[data-guide-change]")) event.target.blur();
    if (event.key !== "Enter" || !event.target.matches?.("[data-guide-field], input[data-cell]")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (event.target.dataset.cell === undefined) check(event.target);
    else event.target.closest("fieldset").querySelector("[data-guide-do=fields]")?.click();
  }, true);

  // What is typed and not yet sent is there again when the page is, unless the service says something else by now.
  const DRAFTS = "kinboard-drafts";
  const MOST_DRAFTS = 20; // questions
  const TYPED = ":is(input, textarea)[data-cell]:not([readonly])";
  let drafts = dom.tab.json(DRAFTS, []); // [question, { cell: [what is typed, what the service said before] }], the newest first
  function keepDrafts(now) {
    drafts = now.slice(0, MOST_DRAFTS);
    dom.tab.set(DRAFTS, JSON.stringify(drafts));
  }
  const placeOf = (node) => node.closest("[data-of]")?.dataset.of;
  /** The question of a typed cell, with arm and words in a lesson, with its variant in an exercise; undefined: it is no answer. */
  function questionOf(cell) {
    const asked = cell.closest("[data-question]");
    return asked ? `${placeOf(cell)} ${asked.dataset.question} ${asked.querySelector("legend")?.textContent}` : placeOf(cell);
  }
  const draftOf = (question) => drafts.find(([each]) => each === question)?.[1];
  on("input", TYPED, (cell) => {
    const question = questionOf(cell);
    if (question === undefined) return;
    const typed = { ...draftOf(question), [cell.dataset.cell]: [cell.value, cell.defaultValue] };
    keepDrafts([[question, typed], ...drafts.filter(([each]) => each !== question)]);
  });
  /** What forgets the draft of a lesson's question once the service has it. Exercises do not show an answer again. */
  function forgetting(node) {
    const asked = node.closest("[data-question]");
    const sent = asked && draftOf(questionOf(node));
    return sent ? (error) => {
      if (error || asked.querySelector("[aria-invalid]")) return; // it was not read
      keepDrafts(drafts.filter(([, each]) => each !== sent));
    } : null;
  }
  let filled = new WeakMap(); // cell → what the service said when it was looked at
  function fill() {
    for (const cell of dom.all(`.kb-question ${TYPED}`)) {
      if (filled.get(cell) === cell.defaultValue || cell.value !== cell.defaultValue) continue;
      filled.set(cell, cell.defaultValue);
      const [text, before] = draftOf(questionOf(cell))?.[cell.dataset.cell] ?? [];
      if (text === undefined || before !== cell.defaultValue || text === cell.value) continue;
      cell.value = text;
      cell.dispatchEvent(new Event("input", { bubbles: true })); // static/parts.js keeps what is typed
    }
  }

  addEventListener("kinboard-connect", () => { filled = new WeakMap(); });

  // Focus: kept when its control comes in another block; where the control is gone, the question or the block gets it.
  const NAMES = ["data-guide-do", "data-guide-field", "data-question-key", "data-argument", "data-cell", "data-guide-change"];
  let focus = null; // selectors of the block and the control, and key of the question
  let gone = false; // the visitor has moved the focus away
  addEventListener("focusin", ({ target }) => {
    const node = dom.closest(target, ".kb-guide :is([data-guide-do], [data-guide-field], [data-cell], [data-guide-change])");
    gone = false;
    focus = node && {
      block: `[data-guide="${node.closest(".kb-guide").dataset.guide}"]`,
      control: NAMES.filter((name) => node.hasAttribute(name)).map((name) => `[${name}="${node.getAttribute(name)}"]`).join(""),
      question: node.closest("[data-question]")?.dataset.question,
    };
  });
  addEventListener("pointerdown", () => { gone = true; }, true);
  addEventListener("focusout", (event) => {
    // A control that is taken away loses the focus without the visitor's doing.
    if (!event.relatedTarget && event.target.closest?.(".kb-guide")) queueMicrotask(() => { gone = event.target.isConnected; });
  });
  function restore() {
    if (!focus || gone || document.activeElement !== document.body) return;
    const block = document.querySelector(focus.block);
    const node = block?.querySelector(focus.control) ?? document.querySelector(`.kb-guide ${focus.control}`)
      ?? block?.querySelector(`[data-question="${focus.question}"] [data-guide-do]`)
      ?? (block?.dataset.feature && block.querySelector(".kb-question :is(button, input)"))
      ?? block?.querySelector(".kb-guide-turn button:last-child") ?? block?.querySelector("[data-first]");
    node?.focus({ preventScroll: true });
  }
  // What is said to an answer is seen, with its reason, unless the visitor has gone on meanwhile.
  let expected = null; // { words, before }: where it will be, and what is there now
  const wordsAt = (selector) => dom.all(selector).find((node) => node.textContent && node.getClientRects().length);
  function expectWords(node, kind) {
    if (![...ANSWERS, "check", "reveal"].includes(kind)) return;
    const key = node.closest("[data-question]")?.dataset.question;
    const words = key === undefined ? "[data-exercises-verdict], [data-feedback=assign]" : `[data-feedback="${key}"]`;
    const said = wordsAt(words); // the same answer is answered in the same words
    said?.scrollIntoView({ block: "nearest" });
    expected = { words, before: said?.textContent };
  }
  function showWords() {
    const node = expected && wordsAt(expected.words);
    if (!node || node.textContent === expected.before) return;
    expected = null;
    node.scrollIntoView({ block: "nearest" });
    dispatchEvent(new CustomEvent("kinboard-say", { detail: node.textContent }));
  }
  for (const kind of ["pointerdown", "wheel"]) addEventListener(kind, () => { expected = null; until = 0; }, { capture: true, passive: true });
  // What has just been opened is seen from its head: a course's bar, an exercise, the list of a course, a step. What
  // stands below comes a moment later, and until then there may be too little to scroll.
  const SETTLES = 1000; // ms
  let open = "", step = "", until = 0;
  function reveal() {
    const bar = document.querySelector("[data-course=bar]");
    const head = bar ?? document.querySelector("[data-exercises=task], [data-course=follow], [data-course=choose]");
    const now = [bar?.dataset.at, document.querySelector("[data-exercise]")?.dataset.exercise, head?.dataset.course].join(" ");
    if (now !== open) {
      const first = open === "";
      open = now;
      until = first ? 0 : performance.now() + SETTLES;
    }
    if (head?.getBoundingClientRect().height && performance.now() < until) requestAnimationFrame(() => head.scrollIntoView({ block: "start" }));
    const [goal, steps] = ["goal", "steps"].map((name) => document.querySelector(`[data-guide=${name}]`));
    if (!steps || !goal) { if (document.querySelector("[data-hints]")) step ||= "none"; return; }
    const [lesson, before] = [goal.dataset.lesson, step];
    step = `${lesson} ${steps.dataset.step}`;
    const goesOn = before.startsWith(`${lesson} `);
    if (step === before || before === "" || (head && !goesOn)) return;
    const from = goesOn ? steps : goal;
    const { top, bottom } = viserPage.panel().getBoundingClientRect();
    const box = from.getBoundingClientRect();
    // Of a step, the buttons at its end are seen too, one of which may have the focus.
    const isLow = goesOn ? box.bottom > bottom : box.top > (top + bottom) / 2;
    if (document.documentElement.hasAttribute("data-kb-narrow") || box.top < top || isLow) {
      if (from.getClientRects().length) from.scrollIntoView({ block: "start" });
    }
  }
  viserPage.watch(fill);
  viserPage.watch(showWords);
  viserPage.watch(reveal);
  viserPage.watch(restore);
})();
