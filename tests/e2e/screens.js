// Checks of a screen, run by test_screens.py with axe loaded; returns a list of sentences.
async () => {
  const problems = [];
  const shown = (node) => node.checkVisibility() && node.getClientRects().length > 0;
  const describe = (node) => node.outerHTML.replace(/ (style|class)="[^"]*"/g, "").slice(0, 170);
  await Promise.all(document.getAnimations().filter((a) => a.effect.getComputedTiming().endTime < 5000).map((a) => a.finished.catch(() => {})));
  const area = document.querySelector("[data-status]")?.closest(".mantine-ScrollArea-viewport");

  const failed = document.querySelector("[data-status=error]");
  if (failed) problems.push(`the page shows an error: ${failed.textContent}`);

  // Nothing sticks out.
  const page = document.documentElement;
  if (page.scrollWidth > innerWidth) problems.push(`the page is ${page.scrollWidth} px wide`);
  if (area) {
    const box = area.getBoundingClientRect();
    const scrolls = (node) => {
      for (let e = node.parentElement; e !== area; e = e.parentElement) {
        if (getComputedStyle(e).overflowX !== "visible") return true;
      }
      return false;
    };
    if (area.scrollWidth > area.clientWidth) problems.push(`the panel is ${area.scrollWidth} px wide`);
    for (const node of area.querySelectorAll("*")) {
      if (node.closest("[data-status], .kb-key")) continue; // over the scene
      const { left, right, width } = node.getBoundingClientRect();
      if (width && shown(node) && (right > box.right + 1 || left < box.left - 1) && !scrolls(node)) {
        problems.push(`cut off, ${Math.round(left)} to ${Math.round(right)} px: ${describe(node)}`);
      }
    }
  }

  // The status is whole, in the window and beside the panel.
  const status = document.querySelector("[data-status]");
  if (status) {
    const { left, top, right, bottom } = status.getBoundingClientRect();
    if (left < 0 || top < 0 || right > innerWidth || bottom > innerHeight) problems.push("the status is cut off");
    for (const node of [status, ...status.querySelectorAll("*")]) {
      if (node.scrollHeight > node.clientHeight + 1 && getComputedStyle(node).overflow !== "visible") problems.push("the status is clipped");
    }
    const panel = area.getBoundingClientRect();
    if (right > panel.left && left < panel.right && bottom > panel.top && top < panel.bottom) problems.push("the status covers the panel");
  }

  // No word in the name of a control is broken.
  const range = document.createRange();
  for (const { firstChild: text } of area?.querySelectorAll(".mantine-Text-root > label") ?? []) {
    for (const { 0: word, index } of text?.data?.matchAll(/\S+/g) ?? []) {
      range.setStart(text, index);
      range.setEnd(text, index + word.length);
      const lines = new Set([...range.getClientRects()].map(({ top }) => Math.round(top)));
      if (lines.size > 1) problems.push(`“${word}” is broken in the name “${text.data}”`);
    }
  }

  // Controls and their labels do not overlap.
  const controls = [...(area ?? document).querySelectorAll(
    'input:not([type="hidden"]), textarea, button, a, summary, label, table, math, [role="slider"], [role="tab"], [role="button"]',
  )].filter(shown);
  const boxes = controls.map((node) => node.getBoundingClientRect());
  const wrapper = (node) => node.closest(".mantine-Input-wrapper") ?? node;
  controls.forEach((a, i) => controls.slice(0, i).forEach((b, k) => {
    const across = Math.min(boxes[i].right, boxes[k].right) - Math.max(boxes[i].left, boxes[k].left);
    const down = Math.min(boxes[i].bottom, boxes[k].bottom) - Math.max(boxes[i].top, boxes[k].top);
    if (across <= 1 || down <= 1 || a.contains(b) || b.contains(a) || wrapper(a) === wrapper(b)) return;
    problems.push(`overlap by ${Math.round(across)} × ${Math.round(down)} px: ${describe(a)} and ${describe(b)}`);
  }));

  // Findings of axe.
  const tags = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"];
  const found = await axe.run(
    { exclude: [["canvas"], ["iframe"]] },
    { resultTypes: ["violations", "incomplete"], runOnly: { type: "tag", values: tags }, iframes: false },
  );
  const nodes = (rules) => rules.flatMap(({ id, nodes }) => nodes.map((node) => ({ id, ...node })));
  for (const { id, element, target, any, all, none } of nodes(found.violations)) {
    const node = element ?? document.querySelector(target[0]);
    problems.push(`${id}: ${[...any, ...all, ...none][0]?.message}: ${node ? describe(node) : target}`);
  }

  // Where axe cannot tell the contrast (see-through text, single letters): colours laid over each other.
  const rgba = (text) => {
    const [r, g, b, a = 1] = text.match(/[\d.]+/g).map(Number);
    const full = text.startsWith("color(") ? 255 * a : a;
    return [r * full, g * full, b * full, a];
  };
  const over = (top, below) => top.map((v, i) => v + below[i] * (1 - top[3]));
  const luminance = (colour) => colour.slice(0, 3).reduce((sum, v, i) => {
    const s = v / 255;
    return sum + [0.2126, 0.7152, 0.0722][i] * (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4);
  }, 0);
  for (const { id, target, any } of nodes(found.incomplete)) {
    const node = document.querySelector(target[0]);
    // In a drawing, what is behind a text is beside it in the document.
    if (id !== "color-contrast" || !node || node.closest("svg")) continue;
    let ink = rgba(getComputedStyle(node).color), ground = [0, 0, 0, 0];
    for (let e = node; e; e = e.parentElement) {
      const style = getComputedStyle(e);
      const behind = rgba(style.backgroundColor);
      [ink, ground] = [ink, ground].map((colour) => over(colour, behind).map((v) => v * style.opacity));
    }
    const white = [255, 255, 255, 1];
    const [a, b] = [ink, ground].map((colour) => luminance(over(colour, white)) + 0.05);
    const ratio = Math.max(a, b) / Math.min(a, b);
    const symbol = any.some((check) => check.data?.messageKey === "nonBmp");
    if (ratio < (symbol ? 3 : 4.5)) problems.push(`contrast ${ratio.toFixed(2)}: ${describe(node)}`);
  }
  return problems;
}
