"use strict";
// Runs in viser's page of a member of a room (app/viewer/room): opens a tab of the panel when the server says so, writes
// this service's address below the join code and the page's where it can be copied, and sees to it that nothing of a
// student's work is lost with the connection.
(() => {
  const $ = (selector) => document.querySelector(selector);

  // The height of the bar with the space around it, which a phone's picture leaves free.
  const AROUND = 20; // px
  let measured = null;
  const size = new ResizeObserver(() => {
    document.documentElement.style.setProperty("--kb-class-bar", `${measured.offsetHeight + AROUND}px`);
  });
  function measure() {
    const bar = $("[data-class-bar]");
    if (bar === measured) return;
    size.disconnect();
    measured = bar;
    if (bar) size.observe(bar);
  }

  let opened = "";
  function follow() {
    const bar = $("[data-class-open]");
    if (bar && bar.dataset.classSerial !== opened && viserPage.openTab(bar.dataset.classOpen)) {
      opened = bar.dataset.classSerial;
      dispatchEvent(new CustomEvent("kinboard-tab", { detail: bar.dataset.classOpen })); // for the next reload
    }
    const address = $("[data-class-address]");
    const room = new URL("../room", location.href).href.replace(/^https?:\/\//, "");
    dom.set(address, "textContent", room);
    for (const node of dom.all("[data-class-hidden-in]")) node.hidden = viserPage.openTitles().includes(node.dataset.classHiddenIn);
  }
  // The page's address is its link. static/viewer.js copies it.
  dom.on("click", "[data-class-here]", (button) => { button.parentElement.querySelector("code").textContent = location.href; }, true);

  // A student's answers: kept in the tab until the service has taken them, and sent again over a new connection.

  const ANSWERS = "kinboard-answers";
  const keep = () => dom.tab.set(ANSWERS, JSON.stringify(answers)); // or only this page has them
  let answers = dom.tab.json(ANSWERS, []); // { id, place, kind, value, since }
  let sent = new Set(); // ids of answers that were sent over this connection
  const member = () => $("[data-class-bar]:not([data-class-bar=closed])");
  const student = () => $("[data-class-bar]:not([data-class-bar=teacher], [data-class-bar=closed])");
  /** The exercise on show and its numbers. */
  function place() {
    const task = $("[data-exercise]");
    return task ? `${task.dataset.exercise} ${task.dataset.variant}` : "";
  }
  function deliver() {
    for (const one of answers) {
      if (sent.has(one.id) || one.place !== place() || !student() || !channel.name()) continue;
      sent.add(one.id);
      channel.send("feature", ["exercises", [one.kind, one.id, Date.now()], one.value], () => {
        answers = answers.filter((each) => each !== one);
        keep();
        tell();
      });
    }
  }
  addEventListener("kinboard-answer", (event) => {
    if (!student()) return;
    event.preventDefault();
    const { kind, value } = event.detail;
    if (answers.some((one) => one.place === place())) return; // a second press while the first is on its way
    const id = [...crypto.getRandomValues(new Uint8Array(8))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
    answers.push({ id, place: place(), kind, value, since: Date.now() });
    keep();
    deliver();
    setTimeout(tell, WAITING);
  });

  // The connection: a browser notices late that nothing comes through any more, and a page must not look ready then. What
  // comes from the service shows that it is there. It is asked for only while that is in doubt: after something was sent
  // and nothing has come, after the connection has ended, and after a long silence.

  const EVERY = 700; // ms between two looks at the connection, and two questions while it is in doubt
  const SILENCE = 5000; // ms; the service gives a sign every two seconds
  const PATIENCE = 1400; // ms for an answer of the service
  const WAITING = 2500; // ms after which it is said that an answer waits
  let online = true;
  let sure = 0; // until when (ms) the connection is not in doubt
  let asked = 0; // since when (ms) a sign of the service is awaited; 0: it is not
  const note = $(".kb-class-offline");
  function tell() {
    const late = answers.filter((one) => Date.now() - one.since >= WAITING).length;
    const waits = answers.length && (late || !online) ? "Your answer is waiting, and is sent when the connection is back." : "";
    const kept = student() ? "What you typed and opened is kept." : "Students can go on by themselves. What you see here is from before.";
    const words = online ? waits : `No connection. ${waits || kept}`;
    const shown = member() ? words : "";
    document.documentElement.toggleAttribute("data-kb-offline", Boolean(shown) && !online);
    dom.set(note, "textContent", shown);
    note.hidden = !shown;
  }
  function become(state) {
    online = state;
    tell();
  }
  function heard() {
    sure = Date.now() + SILENCE;
    asked = 0;
    if (!online) become(true);
  }
  function doubt() { sure = 0; }
  function look() {
    if (member() && !document.hidden && Date.now() >= sure) {
      channel.ask();
      if (asked && Date.now() - asked >= PATIENCE) become(false);
      asked ||= Date.now();
    }
    tell(); // the page may have come into a room, or left it
  }
  viserPage.watchLine(doubt);
  channel.watchLine((what) => { if (what === "heard") heard(); else doubt(); });
  addEventListener("offline", () => { doubt(); become(false); });
  addEventListener("online", () => tell());
  setInterval(look, EVERY);

  // A new connection counts from the beginning.
  addEventListener("kinboard-connect", () => { opened = ""; sent = new Set(); });
  viserPage.watch(follow);
  viserPage.watch(measure);
  viserPage.watch(deliver);
})();
