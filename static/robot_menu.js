"use strict";
// Runs in viser's page: menus that offer robots show their pictures and makers. The service says which there are in
// [data-robots]: name in the menu → id of a picture in static/robots, or "", and maker.
(() => {
  let text = "";
  let robots = {};

  function decorate() {
    const options = dom.all("[data-combobox-option]");
    if (!options.length) return;
    const said = document.querySelector("[data-robots]")?.dataset.robots ?? "{}";
    if (said !== text) {
      text = said;
      robots = JSON.parse(said);
    }
    for (const option of options) {
      const name = option.textContent.trim();
      if (option.dataset.kbRobot === name || !Object.hasOwn(robots, name)) continue;
      const [picture, maker] = robots[name];
      option.dataset.kbRobot = name;
      option.style.setProperty("--kb-picture", picture ? `url("../static/robots/${encodeURIComponent(picture)}.webp")` : "none");
      option.dataset.kbMaker = maker;
    }
  }
  viserPage.watch(decorate);
})();
