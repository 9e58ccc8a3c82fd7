// Measures of a screen for docs/accessibility.md, run by test_accessibility.py; what to measure is the argument.
async (what) => {
  const describe = (node) => node.outerHTML.replace(/ (style|class)="[^"]*"/g, "").slice(0, 150);
  const shown = (node) => node.checkVisibility({ visibilityProperty: true }) && node.getClientRects().length > 0;
  const targets = () => [...document.querySelectorAll(
    'button, a[href], input:not([type="hidden"]), textarea, select, summary, [role="slider"], [role="tab"], [role="button"]',
  )].filter((node) => shown(node) && !node.closest("[inert], [aria-hidden=true], .mantine-NumberInput-controls"));

  // WCAG 2.5.8: 24 by 24 px, or a circle of that diameter that touches no other target, or within a sentence.
  if (what === "targets") {
    const box = (node) => {
      const label = node.matches("[type=radio], [type=checkbox]") ? node.labels?.[0] : null;
      return (label ?? node).getBoundingClientRect();
    };
    // The heads of viser's folders are lower, which docs/accessibility.md says.
    const found = targets().filter((node) => !node.matches("div[role=button][aria-expanded]")).map((node) => ({ node, box: box(node) })).filter(({ box: b }) => b.width && b.height);
    const near = (a, b) => { // distance of the middle of a from the box b
      const [x, y] = [a.left + a.width / 2, a.top + a.height / 2];
      return Math.hypot(Math.max(b.left - x, 0, x - b.right), Math.max(b.top - y, 0, y - b.bottom));
    };
    return found.filter(({ node, box: a }) => Math.min(a.width, a.height) < 23.9 && !node.closest("p, li:not(:only-child)")
      && found.some((other) => other.node !== node && !other.node.contains(node) && !node.contains(other.node) && near(a, other.box) < 12))
      .map(({ node, box: a }) => `${Math.round(a.width)} × ${Math.round(a.height)} px: ${describe(node)}`);
  }

  // WCAG 1.4.12: nothing is cut off with this spacing.
  if (what === "spacing") {
    const style = document.createElement("style");
    style.textContent = "* { line-height: 1.5 !important; letter-spacing: .12em !important; word-spacing: .16em !important; } p { margin-bottom: 2em !important; }";
    document.head.append(style);
    await new Promise((done) => { setTimeout(done, 500); });
    // The part that cuts a text off: hidden beyond its edge, and not scrolled there.
    const cuts = (text) => {
      const range = document.createRange();
      range.selectNodeContents(text);
      const boxes = [...range.getClientRects()].filter(({ width, height }) => width > 1 && height > 1);
      const scrolls = [false, false];
      for (let e = text.parentElement; e; e = e.parentElement) {
        const { overflowX, overflowY } = getComputedStyle(e), edge = e.getBoundingClientRect();
        [overflowX, overflowY].forEach((overflow, axis) => { scrolls[axis] ||= ["auto", "scroll"].includes(overflow); });
        const hides = [overflowX, overflowY].map((overflow, axis) => !scrolls[axis] && ["hidden", "clip"].includes(overflow));
        if (boxes.some(({ left, right, top, bottom }) => (hides[0] && (left < edge.left - 2 || right > edge.right + 2))
          || (hides[1] && (top < edge.top - 2 || bottom > edge.bottom + 2)))) return e;
        if (getComputedStyle(e).position === "fixed") return null; // what is around it does not hide it
      }
      return null;
    };
    const found = [];
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let text = texts.nextNode(); text; text = texts.nextNode()) {
      const { parentElement: node } = text;
      if (!text.data.trim() || !shown(node) || node.closest(".kb-hidden, svg, math, style, script, [inert], [aria-hidden=true]")) continue;
      if (cuts(text)) found.push(`“${text.data.trim().slice(0, 60)}” is cut off: ${describe(node)}`);
    }
    style.remove();
    return found;
  }

  // WCAG 1.4.11: the edge of a field against what is around it, 3 to 1. A field in a table has none until it is used.
  if (what === "edges") {
    const rgba = (text) => { const [r, g, b, a = 1] = text.match(/[\d.]+/g).map(Number); return [r, g, b, a]; };
    const luminance = (colour) => colour.slice(0, 3).reduce((sum, v, i) => {
      const part = v / 255;
      return sum + [0.2126, 0.7152, 0.0722][i] * (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
    }, 0);
    const ground = (node) => {
      for (let e = node.parentElement; e; e = e.parentElement) {
        const colour = rgba(getComputedStyle(e).backgroundColor);
        if (colour[3] === 1) return colour;
      }
      return [255, 255, 255, 1];
    };
    return targets().filter((node) => node.matches("input:not([type=range], [type=file], [type=radio]), textarea, select"))
      .filter((node) => !node.closest("td, th") && parseFloat(getComputedStyle(node).borderTopWidth) > 0).flatMap((node) => {
        const below = ground(node), edge = rgba(getComputedStyle(node).borderTopColor);
        const mixed = edge.slice(0, 3).map((v, i) => v * edge[3] + below[i] * (1 - edge[3]));
        const [a, b] = [luminance(mixed), luminance(below)].sort((one, other) => one - other);
        const ratio = (b + 0.05) / (a + 0.05);
        return ratio < 3 ? [`${ratio.toFixed(2)} to 1: ${describe(node)}`] : [];
      });
  }

  // WCAG 2.4.11: the control with the focus is seen, at least in part.
  if (what === "focus") {
    const node = document.activeElement;
    const { left, top, right, bottom, width, height } = node.getBoundingClientRect();
    if (!width || !height) return [];
    const points = [0.1, 0.5, 0.9].flatMap((x) => [0.1, 0.5, 0.9].map((y) => [left + x * (right - left), top + y * (bottom - top)]));
    const seen = points.some(([x, y]) => { const at = document.elementFromPoint(x, y); return at && (node.contains(at) || at.contains(node) || node.labels?.[0]?.contains(at)); });
    return seen ? [] : [describe(node)];
  }
  // WCAG 1.4.10: nothing scrolls sideways, but tables, matrices and plots, each in a frame of its own.
  if (what === "reflow") {
    const area = document.querySelector("[data-status]").closest(".mantine-ScrollArea-viewport");
    return [document.documentElement, area].map((node) => node.scrollWidth - node.clientWidth)
      .filter((more) => more > 0).map((more) => `${more} px too wide`);
  }
  throw new TypeError(`nothing is known of ${what}`);
}
