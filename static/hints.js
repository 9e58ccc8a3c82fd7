"use strict";
// The first minute: three short hints beside what they are about. Each goes away when it is followed or closed, and
// does not come back in this browser. Where tool and arm are in the picture, the service says in [data-hints].
//
// A hint covers neither the arm, nor a handle, nor a tool: it takes the first of its places that is free, and waits
// while there is none.
(() => {
  const STORE = "kinboard-hints";
  const HINTS = [
    { key: "drag", text: "Drag an arrow to move the tool.", target: tool },
    { key: "joint", text: "Or move a joint.", target: slider },
    { key: "learn", text: "Questions? Lessons explain what you see.", target: lessons },
  ];
  const NARROW = 580; // pixels; below, one hint at a time
  const GAP = 8; // pixels between a hint and what it must not cover
  const KEPT_CLEAR = "[data-status], [data-class-bar], #kb-tools, #kb-grip, #kb-axes, .kb-key";

  if (document.documentElement.dataset.kbEmbed) return; // another page explains
  const done = dom.browser.get(STORE);
  if (done === undefined) return; // cannot be remembered: no hints
  const open = new Map(HINTS.filter((hint) => !(done ?? "").split(" ").includes(hint.key)).map((hint) => [hint.key, hint]));
  if (!open.size) return;

  const visible = (box) => box && box.width > 0 && box.top >= 0 && box.bottom <= innerHeight && box.left < innerWidth;
  const panel = () => viserPage.panel()?.getBoundingClientRect();

  /** The picture: its box, and what the service says of it in pixels. */
  function picture() {
    const said = document.querySelector("[data-hints]")?.dataset;
    const area = viserPage.scene()?.getBoundingClientRect();
    if (!said || !area) return null;
    const unit = Math.min(area.width, area.height) / 2;
    const x = (value) => area.x + area.width / 2 + value * unit;
    const y = (value) => area.y + area.height / 2 - value * unit;
    const [toolX, toolY, arrows] = said.hints.split(" ").map(Number);
    const [thick, ...line] = said.arm.split(" ").map(Number);
    const arm = Array.from({ length: line.length / 2 }, (_, i) => ({ x: x(line[2 * i]), y: y(line[2 * i + 1]) }));
    return { area, tool: { x: x(toolX), y: y(toolY) }, arrows: arrows * unit, arm, thick: thick * unit };
  }

  function tool() {
    const seen = picture();
    if (!seen) return null;
    const { area, tool: { x, y }, arrows } = seen;
    if (!arrows) return null; // hidden
    if (x < area.left || x > area.right || y < area.top || y > area.bottom) return null; // out of the picture
    const [left, top] = [Math.max(x - arrows, area.left), Math.max(y - arrows, area.top)];
    return new DOMRect(left, top, Math.min(x + arrows, area.right) - left, Math.min(y + arrows, area.bottom) - top);
  }

  /** A slider of a joint; lessons and other tabs have sliders for other things. */
  function slider() {
    const seen = viserPage.thumbs().map((node) => node.getBoundingClientRect()).filter(visible);
    return innerWidth < NARROW ? seen[0] : seen[Math.min(2, seen.length - 1)];
  }

  function lessons() { return viserPage.tab("Learn")?.getBoundingClientRect(); }

  function close(key) {
    if (!open.delete(key)) return;
    remove(key);
    dom.browser.set(STORE, HINTS.filter((hint) => !open.has(hint.key)).map((hint) => hint.key).join(" "));
    if (open.size) draw();
    else clearInterval(timer);
  }
  function remove(key) { document.querySelector(`.kb-hint[data-hint="${key}"]`)?.remove(); }

  function bubble(hint) {
    const button = dom.element("button", { type: "button", ariaLabel: `Close the hint: ${hint.text}` }, "×");
    button.addEventListener("click", () => close(hint.key));
    const node = dom.element("div", { className: "kb-hint", role: "note" }, dom.element("span", {}, hint.text), button);
    node.dataset.hint = hint.key;
    document.body.append(node);
    return node;
  }

  /** The places of a hint, the best first: left and top edges, and where its arrow points. */
  function* places(key, box, { width, height }) {
    const [middle, level] = [box.left + box.width / 2 - width / 2, box.top + box.height / 2 - height / 2];
    const scene = viserPage.scene().getBoundingClientRect();
    const side = panel();
    if (key === "drag") {
      yield [box.left - width - GAP, level, "none"];
      yield [box.right + GAP, level, "none"];
      yield [middle, box.top - height - GAP, "none"];
      yield [middle, box.bottom + GAP, "none"];
    } else if (innerWidth < NARROW || !side || side.left < width + 40) yield [middle, box.top - height - 14, "down"];
    else yield [side.left - width - 18, level, "right"];
    // Somewhere along the edges of the picture, from the best height on.
    const [left, right] = [scene.left + GAP, scene.right - width - GAP];
    for (let step = 0; step * 20 < scene.height; step++) {
      for (const y of [level - 20 * step, level + 20 * step]) {
        if (y < scene.top + GAP || y + height > scene.bottom - GAP) continue;
        yield [right, y, "none"];
        yield [left, y, "none"];
      }
    }
    const center = scene.left + (scene.width - width) / 2;
    yield [center, scene.bottom - height - GAP, "none"];
    yield [center, scene.top + GAP, "none"];
  }

  /** Whether a box is in the window and covers none of these boxes, and neither the arm nor its arrows. */
  function free(box, taken, seen) {
    if (box.left < GAP || box.top < GAP || box.right > innerWidth - GAP || box.bottom > innerHeight - GAP) return false;
    const covers = (other) => box.left < other.right && other.left < box.right && box.top < other.bottom && other.top < box.bottom;
    if (taken.some(covers)) return false;
    const near = (point, room) => {
      const dx = Math.max(box.left - point.x, 0, point.x - box.right);
      const dy = Math.max(box.top - point.y, 0, point.y - box.bottom);
      return Math.hypot(dx, dy) < room;
    };
    if (near(seen.tool, seen.arrows)) return false;
    return !seen.arm.some((end, i) => {
      const start = seen.arm[Math.max(i - 1, 0)];
      const steps = Math.ceil(Math.hypot(end.x - start.x, end.y - start.y) / 6) || 1;
      for (let k = 0; k <= steps; k++) {
        const t = k / steps;
        if (near({ x: start.x + (end.x - start.x) * t, y: start.y + (end.y - start.y) * t }, seen.thick)) return true;
      }
      return false;
    });
  }

  /** Put a hint at the first free place; returns its box, or null where there is none. */
  function put(node, key, box, taken, seen) {
    const { width, height } = node.getBoundingClientRect();
    for (const [x, y, arrow] of places(key, box, { width, height })) {
      const place = new DOMRect(Math.min(Math.max(x, GAP), innerWidth - width - GAP), y, width, height);
      const { left, right, top, bottom } = seen.area;
      const inside = place.left >= left && place.right <= right && place.top >= top && place.bottom <= bottom;
      if ((arrow === "none" && !inside) || !free(place, taken, seen)) continue;
      node.dataset.arrow = arrow;
      node.style.left = `${place.x}px`;
      node.style.top = `${place.y}px`;
      node.style.setProperty("--kb-tip", `${Math.min(Math.max(box.left + box.width / 2 - place.x, 16), width - 16)}px`);
      return place;
    }
    return null;
  }

  function draw() {
    const seen = picture();
    if (!seen) return;
    const titles = viserPage.openTitles();
    if (titles.includes("Learn")) close("learn");
    const clear = [...dom.all(KEPT_CLEAR), ...viserPage.thumbs()];
    const taken = clear.map((node) => node.getBoundingClientRect()).filter((box) => box.width > 0);
    let placed = 0;
    for (const hint of open.values()) {
      // Another tab is open: the visitor has found the way.
      const box = titles.includes("Move") && !(innerWidth < NARROW && placed) ? hint.target() : null;
      if (!visible(box)) { remove(hint.key); continue; }
      const node = document.querySelector(`.kb-hint[data-hint="${hint.key}"]`) ?? bubble(hint);
      const place = put(node, hint.key, box, taken, seen);
      if (!place) { node.remove(); continue; }
      taken.push(place);
      placed++;
    }
  }

  const timer = setInterval(draw, 400);
  addEventListener("resize", draw);
  addEventListener("pointerdown", (event) => {
    if (!(event.target instanceof Element)) return;
    if (event.target.matches("canvas")) close("drag");
    else if (viserPage.isSlider(event.target)) close("joint");
  }, true);
  addEventListener("keydown", (event) => {
    if (viserPage.isThumb(event.target) && /^(Arrow|Page|Home|End)/.test(event.key)) close("joint");
  }, true);
  addEventListener("input", (event) => { // a number beside a slider
    const line = viserPage.lineAt(event.target);
    if (line && viserPage.thumbs().some((thumb) => line.contains(thumb))) close("joint");
  }, true);
})();
