"use strict";
// Runs in viser's page: the frame around it while a connected program drives something with it, with the button that stops that,
// and the question before a press of a button that the program wants confirmed (templates/live/announced.html). The frame is
// beside viser's page, so that it stays when the panel is folded away. lesson.js sends what is pressed. What stops something can
// be pressed whatever dialog is open.
(() => {
  const { element } = dom;
  const frame = document.getElementById("kb-driven");

  let [name, stop] = ["", ["", ""]];
  function draw() {
    frame.hidden = !name;
    document.documentElement.toggleAttribute("data-kb-driven", !frame.hidden);
    const words = element("b", {}, "Drives: ", element("bdi", {}, name ?? ""));
    const line = element("p", {}, words, " ", element("i", {}, "·"), " ", element("span", {}, "nothing here is a safety function"));
    if (stop[0]) {
      const button = element("button", { type: "button" }, stop[1]);
      Object.assign(button.dataset, { guideDo: "halt", questionKey: stop[0] });
      line.append(" ", button);
    }
    frame.replaceChildren(...(name ? [line] : []));
  }
  channel.watch("driven", (value) => { name = value; draw(); });
  channel.watch("stop", (value) => { stop = value; draw(); });

  // A dialog makes all that is beside it inert: while one is open, the frame is in it.
  const home = frame.parentNode;
  viserPage.watch(() => {
    const place = document.querySelector("dialog:modal") ?? home;
    if (frame.parentNode !== place) place.append(frame);
  }, { on: ["open"] });

  // The question. Esc, Cancel and a click beside it answer no, and so does anything else that the program says meanwhile.
  const dialog = document.getElementById("kb-confirm");
  const [title, words, buttons] = dialog.children;
  const [no, yes] = buttons.children;
  dialog.addEventListener("click", ({ target }) => { if (target === dialog || target.closest("button")) dialog.close(); });
  let asked = ""; // selector of the button that was pressed

  dom.on("click", "[data-confirm]", (pressed) => {
    const { textContent, dataset: { confirm, questionKey, argument } } = pressed;
    asked = `[data-confirm][data-question-key="${questionKey}"][data-argument="${argument}"]`;
    const label = textContent.replace(/\s*…$/, "");
    title.textContent = `${label}?`;
    words.textContent = confirm;
    yes.textContent = label;
    Object.assign(yes.dataset, { questionKey, argument });
    const stops = dom.all("[data-guide-do=halt]", pressed.closest("[data-announced]")).map((button) => button.cloneNode(true));
    buttons.replaceChildren(...stops, no, yes);
    dialog.showModal();
  });
  viserPage.watch(() => { if (dialog.open && !document.querySelector(asked)) dialog.close(); }, { delay: 50 });
})();
