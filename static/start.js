"use strict";
// The cover of viser's page until the page is there, and what it says when a script ends before. This is the first script
// of the page, and uses nothing that browsers of 2018 lack: it has to run where the others do not.
(() => {
  const root = document.documentElement;
  const SCHEME = "kinboard-scheme";
  const PATIENCE = 60000; // ms until the page is shown in any case
  const GRACE = 1500; // ms from an error until it is shown: the page may come all the same
  const BROWSERS = "Chrome, Edge, Firefox or Safari of the last two years";
  const SENTENCES = {
    webgl: ["This browser does not draw in 3D.", "WebGL 2 is switched off or missing here, and the arm is drawn with it. Switch on "
    + "hardware acceleration in the settings of the browser and restart it, or use another one: " + BROWSERS + "."],
    other: ["The page could not start.", "Reload it. If that does not help, update the browser or use another one: " + BROWSERS + "."],
  };

  // A browser may forbid storage; then a reload is covered in the system's colours.
  const recall = () => { try { return sessionStorage.getItem(SCHEME); } catch (error) { return void error; } };
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;

  // Until the service knows the colours, viser's page is white: a cover in the right colour hides it.
  root.setAttribute("data-kb-cover", recall() || (dark ? "dark" : "light"));
  const covered = () => root.hasAttribute("data-kb-cover");

  /** The page is there: remove the cover, and what it says. */
  function uncover() {
    root.removeAttribute("data-kb-cover");
    const said = document.getElementById("kb-failed");
    if (said) said.remove();
  }
  addEventListener("kinboard-there", uncover);
  setTimeout(() => { if (!document.getElementById("kb-failed")) uncover(); }, PATIENCE);

  function element(kind, text) {
    const made = document.createElement(kind);
    made.textContent = text;
    return made;
  }

  /** Say on the cover that the page does not come, what can be done, and what the browser said. */
  function say(message) {
    if (!covered() || document.getElementById("kb-failed")) return;
    const draws = document.createElement("canvas").getContext("webgl2");
    const [title, advice] = SENTENCES[draws ? "other" : "webgl"];
    const box = element("div", "");
    box.id = "kb-failed";
    box.setAttribute("role", "alert");
    const again = element("button", "Reload");
    again.type = "button";
    again.addEventListener("click", () => location.reload());
    box.append(element("h1", title), element("p", advice), element("p", "The browser’s message: " + message), again);
    root.append(box);
  }
  const later = (message) => { if (covered()) setTimeout(say, GRACE, String(message).slice(0, 300)); };

  addEventListener("error", (event) => {
    const { target } = event;
    if (target instanceof HTMLScriptElement) later("the script " + target.src + " could not be loaded");
    else if (event.message) later(event.message);
  }, true);
  addEventListener("unhandledrejection", ({ reason }) => later((reason && reason.message) || reason));
})();
