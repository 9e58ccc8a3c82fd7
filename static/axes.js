"use strict";
// Runs in viser's page: the directions of the world frame in a corner of the scene, turned as the camera looks.
(() => {
  const AXES = [["x", "#c62828"], ["y", "#2e7d32"], ["z", "#1565c0"]];
  const LENGTH = 25, END = 8, MIDDLE = 36; // of a drawing of 72 units
  const node = document.getElementById("kb-axes");

  /** The axes in the picture, the farthest first. wxyz: the camera, whose x is to the right, y down, z forward. */
  function seen([w, x, y, z]) {
    const right = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)];
    const down = [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)];
    const ahead = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
    const found = AXES.map(([name, color], i) => ({ name, color, x: right[i], y: down[i], away: ahead[i] }));
    return found.sort((one, other) => other.away - one.away);
  }

  function draw(wxyz) {
    node.innerHTML = seen(wxyz).map(({ name, color, x, y, away }) => {
      const [endX, endY] = [MIDDLE + LENGTH * x, MIDDLE + LENGTH * y].map((value) => value.toFixed(1));
      return `<g data-axis="${name}" opacity="${away > 0.1 ? 0.6 : 1}"><path d="M${MIDDLE} ${MIDDLE}L${endX} ${endY}" stroke="${color}" stroke-width="2.5" stroke-linecap="round"/>`
        + `<circle cx="${endX}" cy="${endY}" r="${END}" fill="${color}"/><text x="${endX}" y="${endY}" dy="3.6">${name}</text></g>`;
    }).join("");
  }

  viserPage.watchCamera(draw);
})();
