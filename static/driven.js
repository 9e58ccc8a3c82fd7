"use strict";
// Runs in viser's page: the frame around it while a connected program drives something with it. The frame is beside viser's
// page, so that it stays when the panel is folded away.
(() => {
  const frame = document.createElement("div");
  frame.id = "kb-driven";
  frame.role = "alert";
  frame.hidden = true;
  addEventListener("DOMContentLoaded", () => document.body.append(frame));

  function element(kind, text) {
    const made = document.createElement(kind);
    made.textContent = text;
    return made;
  }
  channel.watch("driven", (name) => {
    frame.hidden = !name;
    document.documentElement.toggleAttribute("data-kb-driven", !frame.hidden);
    const [line, words] = [element("p", ""), element("b", "Drives: ")];
    words.append(element("bdi", name));
    line.append(words, " ", element("i", "·"), " ", element("span", "nothing here is a safety function"));
    frame.replaceChildren(...(name ? [line] : []));
  });
})();
