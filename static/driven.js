"use strict";
// Runs in viser's page: the frame around it while a connected program drives something with it, with the button that stops that,
// and the question before a press of a button that the program wants confirmed (templates/live/announced.html). The frame is
// beside viser's page, so that it stays when the panel is folded away. lesson.js sends what is pressed.
(() => {
  const frame = document.createElement("div");
  frame.id = "kb-driven";
  frame.role = "alert";
  frame.hidden = true;
  frame.dataset.feature = "connect";

  function element(kind, text, data = {}) {
    const made = document.createElement(kind);
    made.textContent = text;
    Object.assign(made.dataset, data);
    if (kind === "button") made.type = "button";
    return made;
  }

  let [name, stop] = ["", ["", ""]];
  function draw() {
    frame.hidden = !name;
    document.documentElement.toggleAttribute("data-kb-driven", !frame.hidden);
    const [line, words] = [element("p", ""), element("b", "Drives: ")];
    words.append(element("bdi", name));
    line.append(words, " ", element("i", "·"), " ", element("span", "nothing here is a safety function"));
    if (stop[0]) line.append(" ", element("button", stop[1], { guideDo: "halt", questionKey: stop[0] }));
    frame.replaceChildren(...(name ? [line] : []));
  }
  channel.watch("driven", (value) => { name = value; draw(); });
  channel.watch("stop", (value) => { stop = value; draw(); });

  // The question. Esc, Cancel and a click beside it answer no, and so does anything else that the program says meanwhile.
  const dialog = document.createElement("dialog");
  dialog.id = "kb-confirm";
  dialog.role = "alertdialog";
  dialog.dataset.feature = "connect";
  dialog.setAttribute("aria-labelledby", "kb-confirm-title");
  dialog.setAttribute("aria-describedby", "kb-confirm-words");
  dialog.addEventListener("click", ({ target }) => { if (target === dialog || target.closest("button")) dialog.close(); });
  let asked = ""; // selector of the button that was pressed

  function ask({ textContent, dataset: { confirm, questionKey, argument } }) {
    asked = `[data-confirm][data-question-key="${questionKey}"][data-argument="${argument}"]`;
    const label = textContent.replace(/\s*…$/, "");
    const [title, words, buttons] = [element("h2", `${label}?`), element("p", confirm), element("footer", "")];
    [title.id, words.id] = ["kb-confirm-title", "kb-confirm-words"];
    buttons.append(element("button", "Cancel"), element("button", label, { guideDo: "confirm", questionKey, argument }));
    dialog.replaceChildren(title, words, buttons);
    dialog.showModal();
  }
  addEventListener("click", ({ target }) => {
    const button = target instanceof Element ? target.closest("[data-confirm]") : null;
    if (button) ask(button);
  });
  viserPage.watch(() => { if (dialog.open && !document.querySelector(asked)) dialog.close(); }, { delay: 50 });
  addEventListener("DOMContentLoaded", () => document.body.append(frame, dialog));
})();
