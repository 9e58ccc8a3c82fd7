"use strict";
// Runs in viser's page: the frame around it while a connected program drives something with it. The frame is beside viser's
// page, so that it stays when the panel, which brings its words, is folded away.
(() => {
  const frame = document.createElement("div");
  frame.id = "kb-driven";
  frame.role = "alert";
  frame.hidden = true;
  addEventListener("DOMContentLoaded", () => document.body.append(frame));

  viserPage.watchHtml("<div hidden data-driven", (html) => {
    const words = new DOMParser().parseFromString(html, "text/html").body.firstElementChild;
    frame.hidden = !words.childElementCount;
    document.documentElement.toggleAttribute("data-kb-driven", !frame.hidden);
    frame.replaceChildren(...words.children);
  });
})();
