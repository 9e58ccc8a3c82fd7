"use strict";
// The teacher's page of results: asks for the table again while the page is seen.
(() => {
  const EVERY = 3000; // ms
  async function renew() {
    if (!document.hidden) {
      try {
        const answer = await fetch(location.href, { cache: "no-store" });
        const page = new DOMParser().parseFromString(await answer.text(), "text/html");
        const fresh = page.getElementById("results");
        const shown = document.getElementById("results");
        if (fresh && fresh.innerHTML !== shown.innerHTML) shown.replaceChildren(...fresh.childNodes);
      } catch {
        // The service is away: the next time may succeed, and what is shown stays.
      }
    }
    setTimeout(renew, EVERY);
  }
  setTimeout(renew, EVERY);
})();
