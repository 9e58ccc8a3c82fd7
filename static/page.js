"use strict";
// Runs in viser's page, before viser's own script: the page's colours, a picture of the scene.
(() => {
  const root = document.documentElement;
  const DARK = matchMedia("(prefers-color-scheme: dark)");
  const SCHEME = "kinboard-scheme"; // read by static/start.js
  // Without a graphics card, clouds of many points make the page stop: static/viewer.css shows a warning then.
  const gl = document.createElement("canvas").getContext("webgl");
  const renderer = gl?.getParameter(gl.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);
  const slow = /swiftshader|llvmpipe|software|basic render/i.test(renderer ?? "");
  root.toggleAttribute("data-kb-software", slow);
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  // The status card says so, until its note is closed for good.
  const NOTE = "kinboard-software";
  root.toggleAttribute("data-kb-slow", slow && !dom.browser.get(NOTE));
  dom.on("click", "[data-slow-close]", () => {
    root.removeAttribute("data-kb-slow");
    dom.browser.set(NOTE, "closed");
  });

  DARK.addEventListener("change", () => channel.send("system-dark", DARK.matches)); // a new session is greeted with it

  /** Whether the page has its own colours; they are kept for the cover of a reload. */
  function coloured() {
    const scheme = viserPage.colours();
    if (!scheme || !document.querySelector("[data-status]")) return false;
    dom.tab.set(SCHEME, scheme);
    return true;
  }
  addEventListener("pagehide", coloured);

  let there = false; // the cover is removed
  function follow() {
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
    const link = dom.element("a", { download: "kinboard.png" });
    picture.toBlob((blob) => {
      link.href = URL.createObjectURL(blob);
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  }
  dom.on("click", "[data-save-picture]", savePicture);

  // In another page, the wheel scrolls that page, and zooms only with Ctrl or after a press on the scene.
  if (window !== window.top) {
    let engaged = false;
    addEventListener("pointerdown", (event) => { engaged = event.target instanceof HTMLCanvasElement; }, true);
    document.documentElement.addEventListener("pointerleave", () => { engaged = false; });
    addEventListener("wheel", (event) => {
      if (!engaged && !event.ctrlKey && event.target instanceof HTMLCanvasElement) event.stopImmediatePropagation();
    }, { capture: true, passive: true });
  }

  viserPage.watch(follow, { on: ["childList", viserPage.COLOURS], delay: 30 });
})();
