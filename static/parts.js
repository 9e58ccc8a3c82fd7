"use strict";
// Runs in viser's page: blocks of HTML that come by the channel (app/viewer/panel/part.py). morphdom changes what differs, so
// that focus, selection, opened details and a pressed button stay. What scripts and visitors have changed in an element stays
// until the service says something else of it, and what a visitor has typed or chosen until the service has acted on that.
(() => {
  const CONTROLS = "input, textarea, select, button";
  const FIELDS = "input, textarea, select";
  // With another one of these, all within is another thing.
  const PLACES = ["data-of", "data-question"];
  const PLACE = PLACES.map((name) => `[${name}]`).join();
  const VALUES = ["value", "checked", "selected"]; // attributes of fields, which morphdom keeps like their values
  const UNSENT = Infinity;

  const part = (node) => (node instanceof Element ? node.closest("[data-part]") : null);
  const block = (node) => (node instanceof Element ? node.closest(`${PLACE}, [data-part]`) : null);
  const shown = new WeakMap(); // part → the HTML that it shows
  const pending = new Set(); // parts with a field that was left alone
  const said = new WeakMap(); // element → what the service has said of it: name → value
  const changed = new WeakMap(); // field → number of the message with its value
  const unsent = new Set(); // fields without one
  const typing = new WeakSet(); // text fields that have changed since they were left
  let held = null; // the field under the pressed pointer
  let last = null; // the question, row or part in which the visitor has done something last

  // What visitors change

  addEventListener("pointerdown", ({ target }) => { held = target; last = block(target); }, true);
  for (const kind of ["pointerup", "pointercancel"]) addEventListener(kind, () => setTimeout(() => { held = null; }), true); // after its click
  for (const kind of ["click", "keydown"]) addEventListener(kind, ({ target }) => { last = block(target) ?? last; }, true);
  addEventListener("keydown", ({ target, key, ctrlKey, metaKey }) => {
    if (key === "Escape" || ctrlKey || metaKey) typing.delete(target); // what was typed is given up or undone
  }, true);
  for (const kind of ["input", "change"]) {
    addEventListener(kind, ({ target }) => {
      if (!part(target)) return;
      last = block(target);
      typing[kind === "input" ? "add" : "delete"](target);
      if (kind === "change" && changed.has(target) && changed.get(target) !== UNSENT) return; // it was sent letter by letter
      changed.set(target, UNSENT);
      unsent.add(target);
    }, true);
  }
  channel.watchSent((number) => {
    for (const field of unsent) {
      if (field.isConnected && !last?.contains(field)) continue; // a message has what was typed in its own question
      unsent.delete(field);
      changed.set(field, number);
    }
  });
  const isInUse = (field) => field === held || (field === document.activeElement && typing.has(field));
  const isKept = (field) => isInUse(field) || changed.get(field) > channel.followed();

  // What the service says

  const attributes = (node) => new Map([...node.attributes].map(({ name, value }) => [name, value]));
  /** Note what the service has said of a block and all within. */
  function note(root) { for (const node of [root, ...root.querySelectorAll("*")]) said.set(node, attributes(node)); }

  /** Names by which elements are found again: of places, and of controls within a place, which are counted. */
  function keysOf(root) {
    const found = new Map(), counts = new Map();
    for (const node of root.querySelectorAll(`${CONTROLS}, details, [id], ${PLACE}`)) {
      const above = node.parentElement.closest(PLACE);
      const names = node.matches(CONTROLS) ? /^(id|name|data-.*)$/ : /^id$/;
      const own = [...(said.get(node) ?? attributes(node))].filter(([name]) => names.test(name) || PLACES.includes(name));
      const key = JSON.stringify([root.contains(above) ? found.get(above) : "", node.localName, own]);
      counts.set(key, (counts.get(key) ?? 0) + 1);
      found.set(node, `${key} ${counts.get(key)}`);
    }
    return found;
  }

  /** Have the new element say of an attribute what the old one has, unless the service says something else of it now. */
  function merge(old, fresh) {
    const before = said.get(old) ?? attributes(old), now = attributes(fresh);
    said.set(old, now);
    for (const name of new Set([...before.keys(), ...now.keys(), ...old.getAttributeNames()])) {
      if (before.get(name) !== now.get(name) || VALUES.includes(name)) continue;
      if (old.hasAttribute(name)) fresh.setAttribute(name, old.getAttribute(name));
      else fresh.removeAttribute(name);
    }
  }

  function morph(root, html) {
    const fresh = root.cloneNode(false);
    fresh.innerHTML = html;
    const keys = new Map([...keysOf(root), ...keysOf(fresh)]);
    const active = root.contains(document.activeElement) ? document.activeElement : null;
    const marked = active?.matches("input[type=text], textarea") ? [active.selectionStart, active.selectionEnd] : null;
    pending.delete(root);
    morphdom(root, fresh, {
      childrenOnly: true,
      getNodeKey: (node) => keys.get(node),
      onNodeAdded(node) { if (node instanceof Element) said.set(node, attributes(node)); return node; },
      onBeforeElUpdated(old, now) {
        merge(old, now);
        if (!old.matches(FIELDS) || !isKept(old)) return true;
        pending.add(root);
        if (old.matches("select, [type=file]")) return false;
        Object.assign(now, { value: old.value, checked: old.checked });
        return true;
      },
    });
    if (active && active !== document.activeElement && active.isConnected) active.focus({ preventScroll: true });
    if (marked && active === document.activeElement && active.selectionStart !== marked[0]) active.setSelectionRange(...marked);
  }

  function follow(again) {
    let any = false;
    for (const root of document.querySelectorAll("[data-part]")) {
      if (!shown.has(root)) { note(root); shown.set(root, null); }
      const html = channel.value(root.dataset.part);
      if (html === undefined || (html === shown.get(root) && !(again && pending.has(root)))) continue;
      shown.set(root, html);
      morph(root, html);
      any = true;
    }
    return any;
  }
  viserPage.watch(() => follow(false));
  channel.watchTexts(() => { if (follow(true)) viserPage.noteChange(); });
})();
