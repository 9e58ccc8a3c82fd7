"use strict";
// Runs in viser's page, before viser's own script: the page's colours, a picture of the scene.
(() => {
  const root = document.documentElement;
  const DARK = matchMedia("(prefers-color-scheme: dark)");
  const SYSTEM_IS_DARK = "The system is dark"; // label of a check box: see app/viewer/panel/theme.py
  const SCHEME = "kinboard-scheme"; // read by static/start.js
  // Buttons in a corner of the scene: name, drawing, message and argument for the server. The standard views are drawn
  // as an arm seen from there: towards the viewer, bent to the right, from above, and a cube.
  const TOOLS = [
    ["Fit the picture to arm, program and obstacles", '<path d="M4 8V4h4M16 4h4v4M20 16v4h-4M8 20H4v-4"/><circle cx="12" cy="12" r="3.2"/>', "fit-arm", ""],
    ["View from the front", '<path d="M7 21h10M12 21v-9"/><circle cx="12" cy="8" r="4.2"/><circle cx="12" cy="8" r="1.3" fill="currentColor"/>', "look-from", "Front"],
    ["View from the side", '<path d="M3 21h8M7 21V6l10 3.5v5M15 17v-2.5h4V17"/><circle cx="7" cy="5.5" r="1.7" fill="currentColor"/><circle cx="17" cy="9.5" r="1.7" fill="currentColor"/>', "look-from", "Side"],
    ["View from the top", '<circle cx="7.5" cy="12" r="5"/><circle cx="7.5" cy="12" r="1.3" fill="currentColor"/><path d="M8 10.4h8.5v3.2H8M21 9h-4.5v6H21"/>', "look-from", "Top"],
    ["View from a corner", '<path d="M12 3l8 4.5v9L12 21l-8-4.5v-9zM4 7.5l8 4.5 8-4.5M12 12v9"/>', "look-from", "Corner"],
    ["Save a picture of the scene", '<path d="M4 8h3.2l1.6-2.4h6.4L16.8 8H20a1 1 0 0 1 1 1v9.5a1 1 0 0 1-1 1H4a1 1 0 0 1-1-1V9a1 1 0 0 1 1-1z"/><circle cx="12" cy="13.3" r="3.6"/>'],
  ];

  // A browser may forbid storage; then static/start.js covers a reload in the system's colours.
  const keep = (scheme) => { try { sessionStorage.setItem(SCHEME, scheme); } catch { /* see above */ } };

  // Without a graphics card, clouds of many points make the page stop: static/viewer.css shows a warning then.
  const gl = document.createElement("canvas").getContext("webgl");
  const renderer = gl?.getParameter(gl.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);
  const slow = /swiftshader|llvmpipe|software|basic render/i.test(renderer ?? "");
  root.toggleAttribute("data-kb-software", slow);
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  // The status card says so, until its note is closed for good.
  const NOTE = "kinboard-software";
  let closed = "";
  try { closed = localStorage.getItem(NOTE) ?? ""; } catch { /* see above */ }
  root.toggleAttribute("data-kb-slow", slow && !closed);
  addEventListener("click", (event) => {
    if (!(event.target instanceof Element) || !event.target.closest("[data-slow-close]")) return;
    root.removeAttribute("data-kb-slow");
    try { localStorage.setItem(NOTE, "closed"); } catch { /* see above */ }
  });

  /** Tell the service whether the system is dark, with the hidden check box. */
  function tell() {
    const found = viserPage.checkBox(SYSTEM_IS_DARK);
    if (!found) return;
    found.line.hidden = true;
    if (found.box.checked !== DARK.matches) found.box.click();
  }
  DARK.addEventListener("change", tell);

  /** Whether the page has its own colours; they are kept for the cover of a reload. */
  function coloured() {
    const scheme = viserPage.colours();
    if (!scheme || !document.querySelector("[data-status]")) return false;
    keep(scheme);
    return true;
  }
  addEventListener("pagehide", coloured);

  let there = false; // the cover is removed
  function follow() {
    tell();
    if (!coloured() || there) return;
    there = true;
    requestAnimationFrame(() => requestAnimationFrame(() => dispatchEvent(new Event("kinboard-there"))));
  }

  /** Save what the scene shows as a PNG file. */
  function savePicture() {
    const scene = viserPage.scene();
    if (!scene) return;
    const picture = document.createElement("canvas");
    [picture.width, picture.height] = [scene.width, scene.height];
    const pen = picture.getContext("2d");
    // The scene is transparent where nothing is drawn: there it shows the background of viewer.css.
    const colours = getComputedStyle(scene);
    const sky = pen.createRadialGradient(0, 0, 0, 0, 0, 1);
    for (const [at, name] of [[0, "near"], [0.48, "middle"], [1, "far"]]) {
      sky.addColorStop(at, colours.getPropertyValue(`--kb-${name}`).trim());
    }
    pen.setTransform(1.2 * picture.width, 0, 0, 0.95 * picture.height, 0.5 * picture.width, 0.38 * picture.height);
    pen.fillStyle = sky;
    pen.fillRect(-1, -1, 2, 2);
    pen.resetTransform();
    pen.drawImage(scene, 0, 0);
    const link = document.createElement("a");
    link.download = "kinboard.png";
    picture.toBlob((blob) => {
      link.href = URL.createObjectURL(blob);
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  }

  // In another page, the wheel scrolls that page, and zooms only with Ctrl or after a press on the scene.
  if (window !== window.top) {
    let engaged = false;
    addEventListener("pointerdown", (event) => { engaged = event.target instanceof HTMLCanvasElement; }, true);
    document.documentElement.addEventListener("pointerleave", () => { engaged = false; });
    addEventListener("wheel", (event) => {
      if (!engaged && !event.ctrlKey && event.target instanceof HTMLCanvasElement) event.stopImmediatePropagation();
    }, { capture: true, passive: true });
  }

  addEventListener("DOMContentLoaded", () => {
    const tools = document.createElement("div");
    tools.id = "kb-tools";
    tools.role = "group";
    tools.ariaLabel = "Camera and picture";
    for (const [name, drawing, sent, argument] of TOOLS) {
      const button = document.createElement("button");
      button.type = "button";
      button.ariaLabel = button.title = name;
      button.innerHTML = `<svg viewBox="0 0 24 24" width="20" height="20" fill="none" stroke="currentColor" stroke-width="1.6" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true">${drawing}</svg>`;
      if (sent) Object.assign(button.dataset, { send: sent, argument });
      else button.addEventListener("click", savePicture);
      tools.append(button);
    }
    document.body.append(tools);
  });
  viserPage.watch(follow, { on: ["childList", viserPage.COLOURS], delay: 30 });
})();
