"use strict";
// The first minute: three short hints beside what they are about. Each goes away when it is followed or closed, and
// does not come back in this browser. Where the tool is in the picture, the service says in [data-hints].
(() => {
  const STORE = "kinboard-hints";
  const HINTS = [
    { key: "drag", text: "Drag an arrow to move the tool.", target: tool },
    { key: "joint", text: "Or move a joint.", target: slider },
    { key: "learn", text: "Questions? Lessons explain what you see.", target: lessons },
  ];
  const NARROW = 580; // pixels; below, one hint at a time

  if (document.documentElement.dataset.kbEmbed) return; // another page explains
  let done = "";
  try { done = localStorage.getItem(STORE) ?? ""; } catch { return; } // cannot be remembered: no hints
  const open = new Map(HINTS.filter((hint) => !done.split(" ").includes(hint.key)).map((hint) => [hint.key, hint]));
  if (!open.size) return;

  const visible = (box) => box && box.width > 0 && box.top >= 0 && box.bottom <= innerHeight && box.left < innerWidth;
  const panel = () => viserPage.panel()?.getBoundingClientRect();

  function tool() {
    const place = document.querySelector("[data-hints]")?.dataset.hints.split(" ").map(Number);
    const area = viserPage.scene()?.getBoundingClientRect();
    if (!place || !area) return null;
    const unit = Math.min(area.width, area.height) / 2;
    const arrows = place[2] * unit;
    const [x, y] = [area.x + area.width / 2 + place[0] * unit, area.y + area.height / 2 - place[1] * unit];
    if (x < area.left || x > area.right || y < area.top || y > area.bottom) return null; // out of the picture
    const [left, top] = [Math.max(x - arrows, area.left), Math.max(y - arrows, area.top)];
    return new DOMRect(left, top, Math.min(x + arrows, area.right) - left, Math.min(y + arrows, area.bottom) - top);
  }

  /** A slider of a joint; lessons and other tabs have sliders for other things. */
  function slider() {
    const thumbs = (viserPage.openTitles().includes("Move") ? viserPage.thumbs() : []).map((node) => node.getBoundingClientRect());
    const seen = thumbs.filter(visible);
    return innerWidth < NARROW ? seen[0] : seen[Math.min(2, seen.length - 1)];
  }

  function lessons() { return viserPage.tab("Learn")?.getBoundingClientRect(); }

  function close(key) {
    if (!open.delete(key)) return;
    document.querySelector(`.kb-hint[data-hint="${key}"]`)?.remove();
    try { localStorage.setItem(STORE, HINTS.filter((hint) => !open.has(hint.key)).map((hint) => hint.key).join(" ")); } catch { /* as above */ }
    if (open.size) draw();
    else clearInterval(timer);
  }

  function bubble(hint) {
    const node = document.createElement("div");
    node.className = "kb-hint";
    node.dataset.hint = hint.key;
    node.setAttribute("role", "note");
    const text = document.createElement("span");
    text.textContent = hint.text;
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "×";
    button.setAttribute("aria-label", `Close the hint: ${hint.text}`);
    button.addEventListener("click", () => close(hint.key));
    node.append(text, button);
    document.body.append(node);
    return node;
  }

  /** Beside the tool; left of a docked panel; above what it is about on a phone. */
  function put(node, box, key) {
    const { width, height } = node.getBoundingClientRect();
    const side = panel();
    const above = key !== "drag" && (innerWidth < NARROW || !side || side.left < width + 40);
    let x = (key === "drag" ? box.left : side?.left ?? 0) - width - (key === "drag" ? 6 : 18);
    let y = box.top + box.height / 2 - height / 2;
    if (above || x < 8) {
      const scene = viserPage.scene().getBoundingClientRect();
      x = box.left + box.width / 2 - width / 2;
      if (key !== "drag") y = box.top - height - 14;
      else y = box.bottom + height + 8 < scene.bottom ? box.bottom + 4 : scene.top + 6; // clear of the arm
    }
    node.dataset.arrow = key === "drag" ? "none" : above ? "down" : "right";
    node.style.left = `${Math.min(Math.max(x, 8), innerWidth - width - 8)}px`;
    node.style.top = `${Math.min(Math.max(y, 8), innerHeight - height - 8)}px`;
    node.style.setProperty("--kb-tip", `${Math.min(Math.max(box.left + box.width / 2 - parseFloat(node.style.left), 16), width - 16)}px`);
  }

  /** Move a hint below those it would cover, or above where there is no room; returns its place. */
  function apart(node, placed) {
    for (const other of placed) {
      const { left, right, top, bottom, height } = node.getBoundingClientRect();
      if (left >= other.right || right <= other.left || top >= other.bottom + 4 || bottom + 4 <= other.top) continue;
      const below = other.bottom + 8;
      node.style.top = `${below + height <= innerHeight - 8 ? below : Math.max(8, other.top - height - 8)}px`;
      node.dataset.arrow = "none";
    }
    return node.getBoundingClientRect();
  }

  function draw() {
    if (document.querySelector("[data-hints]") === null) return;
    const status = document.querySelector("[data-status]").getBoundingClientRect();
    const placed = [status]; // no hint covers the status card
    for (const hint of open.values()) {
      const box = hint.target();
      let node = document.querySelector(`.kb-hint[data-hint="${hint.key}"]`);
      if (!visible(box) || (innerWidth < NARROW && placed.length > 1)) { node?.remove(); continue; }
      node ??= bubble(hint);
      put(node, box, hint.key);
      placed.push(apart(node, placed));
    }
  }

  const timer = setInterval(draw, 400);
  addEventListener("resize", draw);
  addEventListener("pointerdown", (event) => {
    if (!(event.target instanceof Element)) return;
    if (event.target.matches("canvas")) close("drag");
    else if (viserPage.isSlider(event.target)) close("joint");
    else if (viserPage.titleAt(event.target) === "Learn") close("learn");
  }, true);
})();
