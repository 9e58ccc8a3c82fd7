"use strict";
// What the scripts of a page ask of the browser in more than one place: elements, which come and go with the HTML of the
// service, and what is kept for the next page. It is loaded before the scripts that use it.
const dom = (() => {
  const closest = (node, selector) => (node instanceof Element ? node.closest(selector) : null);

  /** What a browser keeps; one that forbids storage keeps nothing, and `get` returns undefined. */
  const storage = (name) => ({
    get(key) { try { return globalThis[name].getItem(key); } catch { return undefined; } },
    set(key, value) { try { globalThis[name].setItem(key, value); } catch { /* see above */ } },
    /** What is kept as JSON; `none` if that is nothing, or no JSON. */
    json(key, none) { try { return JSON.parse(globalThis[name].getItem(key)) ?? none; } catch { return none; } },
    remove(key) { try { globalThis[name].removeItem(key); } catch { /* see above */ } },
  });

  return {
    /** Kept for the next page of this tab, or of this browser. */
    tab: storage("sessionStorage"),
    browser: storage("localStorage"),
    all: (selector, root = document) => [...root.querySelectorAll(selector)],
    /** As the method of an element, for whatever may be the target of an event. */
    closest,
    /** Call `act(element, event)` for events in an element that matches, also in one that comes later. Kinds are words. */
    on(kinds, selector, act, options) {
      for (const kind of kinds.split(" ")) {
        addEventListener(kind, (event) => {
          const found = closest(event.target, selector);
          if (found) act(found, event);
        }, options);
      }
    },
    /** A new element with these properties. */
    element(kind, properties, ...children) {
      const made = Object.assign(document.createElement(kind), properties);
      made.append(...children);
      return made;
    },
    /** Set a property of an element if it has another value: nothing changes for those who watch the page. */
    set(node, name, value) { if (node && node[name] !== value) node[name] = value; },
  };
})();
