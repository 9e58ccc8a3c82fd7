"use strict";
// The printable page of a worksheet. The page of the arm (static/sheets.js), which opened it, hands over what it shows.
(() => {
  addEventListener("message", (event) => {
    if (event.origin !== location.origin || event.source !== window.opener) return;
    const { kinboardSheet: html, title } = event.data ?? {};
    if (typeof html !== "string") return;
    document.querySelector("main").innerHTML = html;
    document.querySelector("nav").hidden = Boolean(document.querySelector("[data-withheld]")); // there is nothing to print
    document.querySelector("nav span").hidden = !document.querySelector("[data-solutions]");
    if (title) document.title = title;
    document.body.dataset.ready = "1";
  });
  document.querySelector("[data-print]").addEventListener("click", () => print());
  window.opener?.postMessage("kinboard-sheet-ready", location.origin);
})();
