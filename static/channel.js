"use strict";
// The page's own connection to its session (app/viewer/session/channel/ says what both send): messages of our scripts and
// their answers. viser brings its name, in hidden HTML, with each new session. A connection that is lost is opened again, and
// what was not confirmed is sent again: each message counts once. A new session must not act on messages to the one before.
const channel = (() => {
  const PATIENCE = 3000; // ms for an answer, then `newest` sends the next value
  const PROTOCOL = "kinboard-1";
  const REPLACED = 4000; // code of a connection that a newer one of this page replaces
  const UNREADABLE = [1007, 1008]; // of one that a message has ended
  const LONGEST = 56000; // bytes of a message; the service closes a connection that sends more than 64 KiB at once
  const MOST = 200; // messages that wait for the connection; later ones are refused
  const AGAIN = 500, SELDOM = 4000; // ms until another try to connect
  const ANSWER_WITHIN = 1000; // ms in which a text is answered, however many pictures of a moving arm come
  const DEAD = 6500; // ms without a sign of the service, which gives one every two seconds
  // Their order with changes of viser's controls matters: a mark tells it.
  const IN_ORDER = new Set(["undo", "redo", "travel", "released", "field", "lesson"]);

  let name = ""; // of the channel: what proves whose it is
  let socket = null;
  let opened = false; // whether this session has been connected
  let tries = 0;
  let timer = 0; // of the next try
  let heardAt = 0; // ms
  let answeredAt = 0; // ms
  let number = 0; // of the last message
  let unconfirmed = []; // [number, text]
  let again = false; // whether they wait to be sent over a new connection
  let refused = false; // whether the first of them has ended a connection
  let noted = 0; // the last notice
  const waiting = new Map(); // number of a message → what to do with its reply
  const values = new Map(); // by key
  const watchers = new Map(); // key → what to call with its value
  let followed = 0; // the number of the last message that the values follow
  const textWatchers = [];
  const sendWatchers = [];
  const doers = new Map(); // name of a notice → what to call with its value
  const lineWatchers = [];
  let greeting = () => null; // what a new session is sent first
  const tellLine = (what) => { for (const act of lineWatchers) act(what); };

  const bytes = (text) => new TextEncoder().encode(text).length;
  const isOpen = () => socket?.readyState === WebSocket.OPEN;
  function attempt(act, ...given) { // the others are called all the same
    try { act(...given); } catch (error) { reportError(error); }
  }

  /** Send a message to the session. done(error, readings) gets its answer. Returns whether there is a session. */
  function send(message, argument = null, done = null) {
    if (!name) return false;
    const marked = IN_ORDER.has(message) && viserPage.canMark();
    const text = JSON.stringify([number + 1, message, argument, ...(marked ? [true] : [])], wellFormed);
    const why = bytes(text) > LONGEST ? "This text is too long." : unconfirmed.length >= MOST ? "There is no connection." : "";
    if (why) { done?.(why, []); return true; }
    number++;
    if (done) waiting.set(number, done);
    unconfirmed.push([number, text]);
    for (const act of sendWatchers) attempt(act, number);
    sendText(text);
    if (marked) viserPage.mark(number);
    return true;
  }
  /** Half letters, which no message can have, become marks. */
  const wellFormed = (_, value) => (typeof value === "string" ? value.replace(/\p{Surrogate}/gu, "\ufffd") : value);
  function sendText(text) {
    if (!isOpen() || again) return;
    socket.send(text);
    tellLine("sent");
  }

  /** The session's answer to message `to`; earlier ones without an answer are done too. */
  doers.set("reply", ([to, error, readings]) => {
    for (const [sent, done] of [...waiting]) {
      if (sent > to) continue;
      waiting.delete(sent);
      if (sent === to) attempt(done, error, readings);
      else attempt(done, "", []);
    }
  });

  function hear({ data }) {
    const { set = {}, notices = [], heard, done: acted = followed } = JSON.parse(data);
    heardAt = performance.now();
    unconfirmed = unconfirmed.filter(([sent]) => sent > heard);
    if (again) sendAgain();
    followed = acted;
    for (const [key, value] of Object.entries(set)) {
      if (value === null) values.delete(key);
      else values.set(key, value);
      for (const act of watchers.get(key) ?? []) attempt(act, value);
    }
    for (const act of textWatchers) attempt(act);
    for (const [count, what, value] of notices) {
      if (count <= noted) continue;
      noted = count;
      const act = doers.get(what);
      if (act) attempt(act, value);
    }
    // A picture of a moving arm needs no answer, but who says nothing for long is taken for gone.
    const due = notices.length || !Object.keys(set).length || performance.now() - answeredAt > ANSWER_WITHIN;
    if (isOpen() && due) {
      answeredAt = performance.now();
      socket.send(JSON.stringify(["heard", noted]));
    }
    tellLine("heard");
  }

  /** Send what the service has not heard, but for a message for which it has ended the connection before. */
  function sendAgain() {
    again = false;
    if (refused && unconfirmed.length) {
      const [[sent]] = unconfirmed.splice(0, 1);
      const done = waiting.get(sent);
      waiting.delete(sent);
      if (done) attempt(done, "The service cannot read this.", []);
    }
    refused = false;
    for (const [, text] of unconfirmed) socket.send(text);
  }

  function open() {
    clearTimeout(timer);
    const address = new URL("channel", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    address.search = address.hash = "";
    heardAt = performance.now();
    const made = socket = new WebSocket(address, [PROTOCOL, name]);
    made.addEventListener("open", () => {
      if (socket !== made) return;
      tries = 0;
      heardAt = performance.now();
      again = opened; // once the service has said what it has heard
      if (again) return;
      opened = true;
      dispatchEvent(new Event("kinboard-connect"));
      for (const [, text] of unconfirmed) made.send(text);
    });
    made.addEventListener("message", (event) => { if (socket === made) hear(event); });
    made.addEventListener("close", ({ code }) => {
      if (socket !== made) return;
      socket = null;
      refused ||= UNREADABLE.includes(code);
      tellLine("closed");
      if (code !== REPLACED) timer = setTimeout(open, Math.min(AGAIN * 2 ** tries++, SELDOM));
    });
  }
  function leave() {
    const left = socket;
    socket = null;
    // A browser complains of one that is closed before it is open.
    if (!left) return;
    if (left.readyState === WebSocket.CONNECTING) left.addEventListener("open", () => left.close());
    else left.close();
  }
  setInterval(() => {
    if (!socket || performance.now() - heardAt < DEAD) return;
    leave();
    open();
  }, 1000);

  /** Sends what changes often to a feature: of each key the newest value, and one at a time, however long an answer takes. */
  function newest(feature) {
    const latest = new Map(); // what waits: key as text → [key, value]
    let busy = 0; // the resting of the one that waits for its answer
    let resting = 0, due = 0; // of the next one
    const act = ([key, value], done) => send("feature", [feature, key, value], done);
    function push() {
      clearTimeout(resting);
      if (busy || !latest.size) return;
      const rest = due - performance.now();
      if (rest > 0) { resting = setTimeout(push, rest); return; }
      const [[text, first]] = latest;
      latest.delete(text);
      const mine = busy = setTimeout(next, PATIENCE);
      function next() {
        if (busy !== mine) return;
        clearTimeout(busy);
        busy = 0;
        push();
      }
      act(first, next);
    }
    addEventListener("kinboard-connect", () => { latest.clear(); clearTimeout(busy); busy = 0; });
    return {
      /** Send this value once the one before is answered, and no other has come for some ms. */
      send(key, value, pause = 0) {
        latest.set(JSON.stringify(key), [key, value]);
        due = performance.now() + pause;
        push();
      },
      /** Send everything now, before something else. */
      flush() {
        for (const each of latest.values()) act(each);
        latest.clear();
      },
      /** Whether everything is sent and answered. */
      rests: () => !busy && !latest.size,
    };
  }

  viserPage.watch(() => {
    const found = document.querySelector("[data-channel]")?.dataset.channel ?? name;
    if (found === name) return;
    leave();
    name = found;
    [opened, tries, number, noted, followed, unconfirmed, again, refused] = [false, 0, 0, 0, 0, [], false, false];
    waiting.clear();
    values.clear();
    send("hello", greeting());
    open();
  });

  return {
    send,
    /** Whether messages reach the session now. */
    isOpen,
    /** The name of the present session's channel, "" before the first one. */
    name: () => name,
    /** Send a file to a feature of the session, which says how far it is.
     *  Resolves to 200 if it has come or the page says why not, otherwise to the status of the answer, 0 if there was none. */
    async sendFile(feature, key, fileName, body, signal) {
      const headers = { "X-Kinboard-Channel": name, "X-Kinboard-File": encodeURIComponent(JSON.stringify([feature, key, fileName])) };
      try {
        const answer = await fetch("upload", { method: "POST", headers, body, signal });
        return answer.ok || answer.headers.has("X-Kinboard-Said") ? 200 : answer.status;
      } catch {
        return 0;
      }
    },
    /** Have a new session be sent what `greet` returns before anything else. */
    greet: (greet) => { greeting = greet; },
    /** Whether the session takes what acts: a page that may only look has a mark (app/viewer/page/picture.py), a frozen class too. */
    mayAct: () => document.querySelector("[data-looking], [data-class-frozen]") === null,
    /** Ask the service for a sign of life. */
    ask: () => { if (isOpen()) socket.send('["ask"]'); },
    /** Call `act` with the value of a key, now if there is one and whenever it changes. */
    watch(key, act) {
      watchers.set(key, [...(watchers.get(key) ?? []), act]);
      if (values.has(key)) act(values.get(key));
    },
    /** Call `act` after each text of the service, when its values are known. */
    watchTexts: (act) => { textWatchers.push(act); },
    /** Call `act` with the number of each message that is sent. */
    watchSent: (act) => { sendWatchers.push(act); },
    /** The number of the last message that the values follow. */
    followed: () => followed,
    newest,
    /** The value of a key, or undefined. */
    value: (key) => values.get(key),
    /** Call `act` with the value of each notice of this name. */
    on: (what, act) => { doers.set(what, act); },
    /** Call `act` with "sent" or "heard" when a text goes to the service or comes from it, and with "closed". */
    watchLine: (act) => { lineWatchers.push(act); },
  };
})();
