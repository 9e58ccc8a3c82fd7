"use strict";
// Runs in viser's page of a member of a room (app/viewer/room): opens a tab of the panel when the server says so, and
// writes this service's address below the join code, and the page's where it can be copied.
(() => {
  let opened = "";
  function follow() {
    const bar = document.querySelector("[data-class-open]");
    if (bar && bar.dataset.classSerial !== opened) {
      if (viserPage.openTab(bar.dataset.classOpen)) opened = bar.dataset.classSerial;
    }
    const address = document.querySelector("[data-class-address]");
    const room = new URL("../room", location.href).href.replace(/^https?:\/\//, "");
    if (address && address.textContent !== room) address.textContent = room;
  }
  // The page's address is its link. static/viewer.js copies it.
  document.addEventListener("click", (event) => {
    const button = event.target instanceof Element ? event.target.closest("[data-class-here]") : null;
    if (button) button.parentElement.querySelector("code").textContent = location.href;
  }, true);
  // A new connection counts from the beginning.
  addEventListener("kinboard-connect", () => { opened = ""; });
  viserPage.watch(follow);
})();
