"use strict";
// Shows and drives an SO-101 from a saved page (kinboard page), over the serial port that Chromium gives it: there is no server
// and no program. write_page.py puts this behind servos.js into the page, with the arm's motors in the element #servo-data.
//
// None of this is a safety function: keep the power switch within reach.
(() => {
  const { BOUNDS, Bus, Guide, Scale, calibrated, clamp, errors, goals, named, rad, written } = window.kinboardServos;
  const { StoppedError, BusError } = errors;
  const ALL = JSON.parse(document.getElementById("servo-data").textContent);
  const MOVING = ALL.filter(({ joint }) => joint);
  const LARGEST = 100_000; // bytes of a calibration
  const FASTEST = 180; // deg/s

  // ---- What its reader sees ----

  const section = document.createElement("section");
  section.setAttribute("aria-labelledby", "servo-title");
  section.innerHTML = `<style>
    #servo-status { padding: .4em .8em; border: 1px solid var(--line); border-left: 4px solid var(--of, var(--edge)); border-radius: 6px; }
    #servo-status[data-state="shown"] { --of: #009e73; }
    #servo-status[data-state="driven"] { --of: #d55e00; }
    #servo-status[data-state="wrong"] { --of: var(--bad); }
    [data-servo]:disabled { opacity: .45; cursor: default; }
    [aria-labelledby="servo-title"] [type="number"] { width: 5em; }
    body[data-driven]::after { content: ""; position: fixed; inset: 0; z-index: 9; border: 6px solid #c92a2a; pointer-events: none; }
    </style>
    <h2 id="servo-title">Real arm</h2>
    <p id="servo-status" role="status"></p>
    <p class="row"><label>LeRobot's calibration <input type="file" accept=".json"></label></p>
    <p class="row"><button type="button" data-servo="connect">Connect</button><button type="button" data-servo="enable">Enable</button>
      <button type="button" data-servo="stop" title="Hold the arm where it is (Esc)">Stop</button>
      <button type="button" data-servo="release" title="Switch the motors off: hold the arm with your hand">Release</button></p>
    <p class="row"><label>At most <input type="number" min="1" max="${FASTEST}" step="any" value="20" required> °/s of each joint</label></p>
    <table><tbody></tbody></table>
    <p class="quiet">Orange is where the arm is. None of this is a safety function: keep the arm's power switch within reach.</p>`;
  document.querySelector("aside header").after(section);
  const find = (selector) => section.querySelector(selector);
  const speed = find("[type=number]");
  const rows = MOVING.map(({ joint }) => {
    const row = find("tbody").insertRow();
    row.append(document.createElement("th"));
    row.cells[0].textContent = joint;
    return [row.insertCell(), row.insertCell()];
  });
  // driven: whether this page has switched the motors on; word: the button that was pressed; seen, shown: what is drawn next, last.
  const state = { bus: null, motors: null, driven: false, word: "", wake: () => {}, ghost: null, seen: null, shown: "" };

  function say(kind, text) {
    find("#servo-status").dataset.state = kind;
    find("#servo-status").textContent = text;
    document.body.toggleAttribute("data-driven", state.driven);
    const still = !state.driven;
    const able = { connect: navigator.serial && still, enable: state.bus && state.motors && still, stop: !still, release: state.bus };
    for (const [name, can] of Object.entries(able)) find(`[data-servo=${name}]`).disabled = !can;
    find("[data-servo=connect]").textContent = state.bus ? "Disconnect" : "Connect";
    for (const input of section.querySelectorAll("input")) input.disabled = state.driven;
  }

  // Where the arm is, at the next frame, where it differs: drawing holds up the bus. Without ticks nobody knows.
  function show(ticks, q) {
    const texts = rows.map((_, i) => [ticks ? `${ticks[i]} ticks` : "", q ? written(q[i]) : ""]);
    if (String(texts) === state.shown) return;
    state.shown = String(texts);
    if (!state.seen) requestAnimationFrame(draw);
    state.seen = { texts, q };
  }

  function draw() {
    const { texts, q } = state.seen;
    state.seen = null;
    rows.forEach((cells, i) => cells.forEach((cell, k) => { cell.textContent = texts[i][k]; }));
    const { scene, linkPoses } = window.kinboardArm;
    if (!scene) return;
    state.ghost ??= orange(scene.ghost());
    const poses = q && linkPoses(q).slice(1);
    state.ghost.forEach((link, i) => {
      link.visible = Boolean(poses);
      if (poses) link.matrix.set(...poses[i]);
      link.matrixWorldNeedsUpdate = true;
    });
    scene.draw();
  }

  function orange(links) {
    const material = new THREE.MeshStandardMaterial({ color: 0xe69f00, transparent: true, opacity: 0.45, depthWrite: false });
    for (const link of links) {
      link.matrixAutoUpdate = false;
      for (const mesh of link.children) mesh.material = material;
    }
    return links;
  }

  // ---- The session: a mirror that writes nothing, until Enable is pressed; then the arm follows ----

  const sleep = (seconds) => new Promise((done) => {
    const timer = setTimeout(done, 1000 * seconds);
    state.wake = () => { clearTimeout(timer); done(); };
  });

  function press(name) {
    state.word = name;
    state.wake();
  }

  function taken() {
    const name = state.word;
    state.word = "";
    return name;
  }

  // Reads the servos again and again, and nothing else; returns the button that ends it.
  async function mirror(bus) {
    let lost = "";
    for (;;) {
      const name = taken();
      if (["enable", "release", "end"].includes(name)) return name;
      try {
        const ticks = await bus.positions(state.motors ?? MOVING);
        show(ticks, state.motors && new Scale(state.motors, ticks).q(ticks));
        if (lost) say("shown", "All servos answer again.");
        lost = "";
      } catch (error) {
        if (!(error instanceof BusError) || bus.lost) throw error;
        const said = find("#servo-status").textContent.includes(error.message); // as why the arm was stopped
        if (error.message !== lost && !said) say("wrong", `${error.message}. The ghost is hidden meanwhile.`);
        lost = error.message;
        show(null, null);
      }
      await sleep(lost ? BOUNDS.RESTING : BOUNDS.CYCLE);
    }
  }

  // The scale of an arm that may be switched on.
  async function scaled(bus) {
    if (!speed.validity.valid) throw new StoppedError(`Speed: got ${speed.value}, expected 1 to ${FASTEST} degrees per second`);
    const ticks = await bus.positions(state.motors);
    state.motors.forEach((motor, i) => {
      const [low, high] = motor.range;
      if (ticks[i] >= low - BOUNDS.MARGIN && ticks[i] <= high + BOUNDS.MARGIN) return;
      const where = `${named(motor)} is at ${ticks[i]} ticks, outside its calibrated range from ${low} to ${high}`;
      throw new StoppedError(`${where}: is the calibration of another arm, or older? Nothing was moved`);
    });
    return new Scale(state.motors, ticks);
  }

  // Switches the motors on where the arm is, and the page takes that over, so that nothing moves at first.
  async function begun(bus, scale) {
    const lost = await bus.hold(state.motors); // the goal first: a servo that is switched on goes to its last one
    if (lost.length) throw new BusError(lost.join("; "));
    await bus.torque(state.motors, true);
    const q = scale.q(await bus.positions(state.motors));
    const inside = q.map((value, i) => clamp(value, state.motors[i].lower, state.motors[i].upper));
    window.kinboardArm.go(inside);
    await sleep(0.1);
    const shown = window.kinboardArm.q();
    if (shown.some((value, i) => Math.abs(value - inside[i]) > BOUNDS.SAME)) {
      throw new StoppedError("The page has not taken over where the arm is. Nothing was moved");
    }
    return new Guide(state.motors, q, shown, scale.limits, rad(speed.valueAsNumber), performance.now() / 1000);
  }

  // Until a button is pressed, or nobody sees the page: a browser slows it down then.
  async function lead(bus, scale) {
    const guide = await begun(bus, scale);
    say("driven", "The arm follows the page.");
    for (;;) {
      const ticks = await bus.positions(state.motors);
      if (state.word || document.hidden) return;
      const measured = scale.q(ticks);
      show(ticks, measured);
      const before = guide.asked;
      const asked = guide.step(measured, window.kinboardArm.q(), performance.now() / 1000);
      if (asked.some((value, i) => value !== before[i])) {
        const to = scale.ticks(asked);
        await bus.write(goals(state.motors.map(({ id }, i) => [id, to[i]]).filter((_, i) => guide.commanded[i])));
      }
      if (!document.hidden) await sleep(BOUNDS.CYCLE); // timers of a hidden page take a second
    }
  }

  async function follow(bus) {
    const scale = await scaled(bus);
    state.driven = true;
    say("driven", "The motors are being switched on where the arm is.");
    let why = null;
    try {
      await lead(bus, scale);
    } catch (error) {
      why = error;
    }
    const name = taken();
    const lost = name === "release" && !why ? [] : await bus.hold(state.motors);
    state.driven = false;
    if (why && !(why instanceof StoppedError)) throw why;
    const reasons = [...new Set([...(why ? [why.message] : []), ...lost])];
    if (lost.length) reasons.push("What does not answer goes on to its last goal, which is close by");
    if (reasons.length) throw new StoppedError(`${reasons.join(". ")}. The arm is not moved any further`);
    if (name === "release") return release(bus);
    const hidden = document.hidden ? "This page was hidden. " : "";
    return say("shown", `${hidden}The arm holds its place: its motors stay on until its power is off.`);
  }

  async function release(bus) {
    await bus.torque(ALL, false);
    say("shown", "The motors are off.");
  }

  async function session(bus) {
    say("shown", await bus.check() + (state.motors ? "" : " Choose its calibration, to see it in degrees and to drive it."));
    for (let name = await mirror(bus); name !== "end"; name = await mirror(bus)) {
      try {
        await (name === "enable" ? follow(bus) : release(bus));
      } catch (error) {
        if (!(error instanceof StoppedError) || bus.lost) throw error;
        say("wrong", `${error.message}.`);
      }
    }
  }

  async function connect() {
    let [bus, said] = [null, ["", "Disconnected: the servos stay as they are."]];
    try {
      bus = new Bus(await navigator.serial.requestPort(), ALL);
      Object.assign(state, { bus, word: "" });
      say("", "The servos are asked what they are and how they are.");
      await bus.open();
      await session(bus);
    } catch (error) {
      said = ["wrong", error.name === "NotFoundError" ? "No port was chosen." : `${error.message}.`];
      if (!(error instanceof StoppedError) && error.name !== "NotFoundError") reportError(error);
    }
    await bus?.close();
    Object.assign(state, { bus: null, driven: false });
    say(...said);
    show(null, null);
  }

  section.addEventListener("click", (event) => {
    const name = event.target.closest("[data-servo]")?.dataset.servo;
    if (name === "connect" && !state.bus) connect();
    else if (name) press(name === "connect" ? "end" : name);
  });
  find("[type=file]").addEventListener("change", async ({ target: { files: [file] } }) => {
    if (!file) return;
    try {
      if (file.size > LARGEST) throw new StoppedError(`Calibration: ${file.size} bytes, expected at most ${LARGEST}`);
      state.motors = calibrated(await file.text(), MOVING);
      say(state.bus ? "shown" : "", "The calibration was read. Nothing is written to the servos before Enable.");
    } catch (error) {
      if (!(error instanceof StoppedError)) throw error;
      state.motors = null;
      say("wrong", `${error.message}.`);
    }
  });
  document.addEventListener("keydown", ({ key }) => { if (key === "Escape" && state.driven) press("stop"); });
  document.addEventListener("visibilitychange", () => state.wake());
  navigator.serial?.addEventListener("disconnect", ({ target }) => { if (target === state.bus?.port) state.bus.lose("it was unplugged"); });
  if (navigator.serial) say("", "Nothing is connected. Close LeRobot and other programs that use the port first.");
  else say("wrong", "This browser has no WebSerial: use Chromium, Chrome or Edge on a computer, or kinboard so101.");
})();
