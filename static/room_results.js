"use strict";
// The teacher's page of results: asks for the tables again while the page is seen. What is open there stays open.
(() => {
  const EVERY = 3000; // ms
  async function renew() {
    if (!document.hidden) {
      try {
        const answer = await fetch(location.href, { cache: "no-store" });
        const page = new DOMParser().parseFromString(await answer.text(), "text/html");
        const fresh = page.getElementById("results");
        if (fresh) show(fresh);
      } catch {
        // The service is away: the next time may succeed, and what is shown stays.
      }
    }
    setTimeout(renew, EVERY);
  }
  function show(fresh) {
    const shown = document.getElementById("results");
    const open = new Set([...shown.querySelectorAll("details[open]")].map((each) => each.dataset.key));
    const focused = document.activeElement?.closest("details")?.dataset.key;
    for (const each of fresh.querySelectorAll("details")) each.open = open.has(each.dataset.key);
    if (fresh.innerHTML === shown.innerHTML) return;
    shown.replaceChildren(...fresh.childNodes);
    if (focused) [...shown.querySelectorAll("details")].find((each) => each.dataset.key === focused)?.firstElementChild.focus();
  }
  setTimeout(renew, EVERY);
})();
