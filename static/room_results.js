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
        if (fresh) morphdom(document.getElementById("results"), fresh, { getNodeKey: (node) => node.dataset?.key, onBeforeElUpdated: keepOpen });
      } catch {
        // The service is away: the next time may succeed, and what is shown stays.
      }
    }
    setTimeout(renew, EVERY);
  }
  function keepOpen(shown, fresh) {
    if (shown.localName === "details") fresh.open = shown.open;
    return true;
  }
  setTimeout(renew, EVERY);
})();
