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
    const found = targets().map((node) => ({ node, box: box(node) })).filter(({ box: b }) => b.width && b.height);
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
    const found = [...document.querySelectorAll("[data-status], [data-status] *, [data-dock-region] *, [data-kb-panel] *")].filter((node) => {
      if (!shown(node) || node.closest(".kb-hidden, svg, math, [role=tabpanel] [inert]") || !node.textContent.trim()) return false;
      const { overflowX, overflowY } = getComputedStyle(node);
      const cut = (overflow, needed, has) => ["hidden", "clip"].includes(overflow) && needed > has + 2;
      return cut(overflowX, node.scrollWidth, node.clientWidth) || cut(overflowY, node.scrollHeight, node.clientHeight);
    }).map(describe);
    style.remove();
    return found;
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
  throw new TypeError(`nothing is known of ${what}`);
}
