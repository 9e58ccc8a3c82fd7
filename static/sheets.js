"use strict";
// Runs in viser's page: the buttons of a worksheet (app/viewer/worksheet). *Print…* opens static/sheet.html and hands it
// the page that the service puts into the panel.
(() => {
  let serial = 0;
  let opened = null; // the window of the last page, with the number of its request
  const send = (kind) => channel.send("feature", ["sheet", [kind, ++serial], null]);

  function hand() {
    if (!opened?.ready) return;
    const page = document.querySelector(`[data-sheet="${opened.serial}"] [data-sheet-page]`);
    if (!page) return;
    const title = page.content.querySelector("h1")?.textContent;
    opened.window.postMessage({ kinboardSheet: page.innerHTML, title: `${title} – Kinboard` }, location.origin);
    opened = null;
  }

  dom.on("click", "[data-sheet-do]", ({ dataset: { sheetDo: kind } }) => {
    if (kind === "png") { document.querySelector("[data-save-picture]").click(); return; }
    // Opened at once, within the click: later, a browser would take it for an unwanted window.
    const page = kind === "page" ? window.open("../static/sheet.html") : null;
    send(kind);
    if (page) opened = { window: page, serial, ready: false };
  });
  addEventListener("message", (event) => {
    if (event.origin !== location.origin || event.data !== "kinboard-sheet-ready" || event.source !== opened?.window) return;
    opened.ready = true;
    hand();
  });
  viserPage.watch(hand);
})();
