"use strict";
// A saved page of one arm: its sliders, its pose, its postures and its program, without a server. What it shows is in
// the element #data, which app/viewer/takehome wrote; lengths there are metres and angles radians, whatever is on screen.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const { robot } = data;
  const find = (selector) => document.querySelector(selector);
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  // ---- Forward kinematics: T = G_0 · G_1 M(q_1) … G_n M(q_n) · E, matrices of 16 numbers by rows ----

  const UNIT = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

  function product(a, b) {
    const found = new Array(16).fill(0);
    for (let i = 0; i < 4; i++) {
      for (let j = 0; j < 4; j++) {
        for (let k = 0; k < 4; k++) found[4 * i + j] += a[4 * i + k] * b[4 * k + j];
      }
    }
    return found;
  }

  function motion(link, value) {
    if (!link.turns) return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, value, 0, 0, 0, 1];
    const [c, s] = [Math.cos(value), Math.sin(value)];
    return [c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  }

  // Poses of all links, the base first, in the base frame.
  function linkPoses(q, arm = robot) {
    const poses = [UNIT];
    arm.links.forEach((link, i) => poses.push(product(product(poses[i], link.axis), motion(link, link.ratio * q[link.joint]))));
    return poses;
  }

  const fk = (q, arm = robot) => product(linkPoses(q, arm).at(-1), arm.tool);

  // Roll, pitch and yaw of R = Rz(yaw) Ry(pitch) Rx(roll); where the pitch is a quarter turn, the yaw is taken as 0.
  function rollPitchYaw(T) {
    const across = Math.hypot(T[0], T[4]);
    const pitch = Math.atan2(-T[8], across);
    if (across < 1e-9) return [Math.atan2(pitch > 0 ? T[1] : -T[1], T[5]), pitch, 0];
    return [Math.atan2(T[9], T[10]), pitch, Math.atan2(T[4], T[0])];
  }

  // ---- Numbers ----

  const MINUS = "\u2212";
  const state = { q: data.q.slice(), degrees: data.units.degrees, frames: false, posture: -1, time: 0, playing: false };
  const perLength = { mm: 1e3, cm: 1e2, m: 1, in: 1 / 0.0254 }[data.units.length];
  const decimalsOfLength = { mm: 1, cm: 2, m: 4, in: 3 }[data.units.length];
  const unitOf = (turns) => (turns ? (state.degrees ? "°" : "rad") : data.units.length);
  const scaleOf = (turns) => (turns ? (state.degrees ? 180 / Math.PI : 1) : perLength);
  const decimalsOf = (turns) => (turns ? (state.degrees ? 1 : 3) : decimalsOfLength);

  function written(value, turns) {
    const text = (value * scaleOf(turns)).toFixed(decimalsOf(turns));
    return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", MINUS);
  }

  function withUnit(value, turns) {
    const unit = unitOf(turns);
    return `${written(value, turns)}${unit === "°" ? "" : " "}${unit}`;
  }

  // A typed number in radians or metres, or null: an expression such as pi/4, 2*45 or 90deg in the unit on screen, as
  // in the full page. Both minus signs and a comma for the point are read; pi is in radians whatever the unit.
  const PER = { "°": 180 / Math.PI, deg: 180 / Math.PI, rad: 1, mm: 1e3, cm: 1e2, m: 1, in: 1 / 0.0254 };
  const TOKEN = /\s*(?:(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?)|(°|deg|rad|mm|cm|in|m|pi|π)|([-+*/^()]))/iy;

  function tokensOf(text) {
    const found = [];
    TOKEN.lastIndex = 0;
    while (TOKEN.lastIndex < text.length) {
      const part = TOKEN.exec(text);
      if (!part) return null;
      found.push(part[1] ? Number(part[1]) : (part[2] ?? part[3]).toLowerCase());
    }
    return found;
  }

  // A value is [number, whether it has a unit]; what has none is in the unit on screen, once it meets one that has.
  function read(text, turns) {
    const tokens = tokensOf(text.trim().slice(0, 100).replace(/[\u2212\u2013]/g, "-").replace(",", "."));
    const units = turns ? ["°", "deg", "rad"] : ["mm", "cm", "m", "in"];
    const measured = ([value, unit]) => (unit ? value : value / scaleOf(turns));
    const next = (...wanted) => (wanted.includes(tokens[0]) ? tokens.shift() : null);
    const fail = () => { throw new SyntaxError("no number"); };

    function atom() {
      const token = tokens.shift();
      if (token === "(") { const value = sum(); return next(")") ? value : fail(); }
      if (token === "pi" || token === "π") return [Math.PI, turns];
      if (typeof token !== "number") return fail();
      return next("pi", "π") ? [token * Math.PI, turns] : [token, false];
    }
    function power() {
      const [value, unit] = atom();
      if (!next("^")) return [value, unit];
      const sign = next("-") ? -1 : 1;
      const exponent = tokens.shift();
      return unit || typeof exponent !== "number" ? fail() : [value ** (sign * exponent), false];
    }
    function signed() {
      let sign = 1;
      for (let mark = next("+", "-"); mark; mark = next("+", "-")) if (mark === "-") sign = -sign;
      const [value, unit] = power();
      const name = next(...units);
      if (!name) return [sign * value, unit];
      return unit && name !== "rad" ? fail() : [(sign * value) / PER[name], true];
    }
    function term() {
      let [value, unit] = signed();
      for (let mark = next("*", "/"); mark; mark = next("*", "/")) {
        const [other, has] = signed();
        if (has && (unit || mark === "/")) fail();
        value = mark === "*" ? value * other : value / other;
        unit ||= has;
      }
      return [value, unit];
    }
    function sum() {
      let value = term();
      for (let mark = next("+", "-"); mark; mark = next("+", "-")) {
        let other = term();
        if (value[1] || other[1]) { value = [measured(value), true]; other = [measured(other), true]; }
        value = [value[0] + (mark === "+" ? other[0] : -other[0]), value[1]];
      }
      return value;
    }
    try {
      if (!tokens?.length) return null;
      const value = measured(sum());
      return tokens.length || !Number.isFinite(value) ? null : value;
    } catch (error) {
      if (error instanceof SyntaxError) return null;
      throw error;
    }
  }

  // ---- The scene ----

  function bytes(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  }

  function geometry(part) {
    const steps = new Uint16Array(bytes(part.vertices));
    const points = new Float32Array(steps.length);
    for (let i = 0; i < steps.length; i++) points[i] = part.low[i % 3] + steps[i] * part.step[i % 3];
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.BufferAttribute(points, 3));
    const faces = bytes(part.faces);
    made.setIndex(new THREE.BufferAttribute(part.wide ? new Uint32Array(faces) : new Uint16Array(faces), 1));
    made.computeVertexNormals();
    return made;
  }

  const rgb = (color) => new THREE.Color().setRGB(color[0] / 255, color[1] / 255, color[2] / 255, THREE.SRGBColorSpace);

  function axes(length, radius) {
    const group = new THREE.Group();
    [[213, 60, 60], [60, 160, 70], [60, 100, 220]].forEach((color, k) => {
      const rod = new THREE.Mesh(
        new THREE.CylinderGeometry(radius, radius, length, 12), new THREE.MeshStandardMaterial({ color: rgb(color), roughness: 0.8 }),
      );
      rod.position.setComponent(k, length / 2); // the cylinder lies along y
      if (k === 0) rod.rotation.z = -Math.PI / 2;
      if (k === 2) rod.rotation.x = Math.PI / 2;
      group.add(rod);
    });
    return group;
  }

  function place(object, T) {
    object.matrixAutoUpdate = false;
    object.matrix.set(...T);
    object.matrixWorldNeedsUpdate = true;
  }

  const GROUND = { light: ["#f6f7f9", "#c8d0db", "#9ea9b8"], dark: ["#11151a", "#3e4652", "#5e6979"] };

  class Scene {
    constructor(canvas) {
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
      this.scene = new THREE.Scene();
      this.camera = new THREE.PerspectiveCamera(45, 1, data.radius / 50, data.radius * 100);
      this.camera.up.set(0, 0, 1);
      this.controls = new THREE.OrbitControls(this.camera, canvas);
      this.controls.addEventListener("change", () => this.draw());
      this.waiting = false;
      this.light();
      this.links = robot.links.map(() => new THREE.Group());
      this.links.unshift(new THREE.Group());
      this.scene.add(...this.links);
      for (const part of data.parts) {
        const material = new THREE.MeshStandardMaterial({
          color: rgb(part.color), roughness: 0.62, side: part.double ? THREE.DoubleSide : THREE.FrontSide,
        });
        const mesh = new THREE.Mesh(geometry(part), material);
        if (part.pose) place(mesh, part.pose);
        mesh.castShadow = true;
        this.links[part.link].add(mesh);
      }
      this.frames = data.frames.map(({ link, pose }) => {
        const frame = axes(data.size * 3.2, data.size * 0.09);
        place(frame, pose);
        frame.visible = false;
        this.links[link].add(frame);
        return frame;
      });
      if (data.target) {
        this.target = axes(data.size * 4, data.size * 0.12);
        place(this.target, data.target.pose);
        this.scene.add(this.target);
      }
      this.fit();
    }

    light() {
      const key = new THREE.DirectionalLight(0xfffcf6, 2.6);
      const aim = new THREE.Vector3(...data.center);
      key.position.copy(new THREE.Vector3(0.95, -0.15, 1.6).normalize().multiplyScalar(5 * data.radius).add(aim));
      key.target.position.copy(aim);
      key.castShadow = true;
      key.shadow.mapSize.set(2048, 2048);
      key.shadow.normalBias = data.size * 0.2;
      const reach = 2.2 * data.radius;
      const beam = { left: -reach, right: reach, top: reach, bottom: -reach, near: data.radius, far: 10 * data.radius };
      Object.assign(key.shadow.camera, beam);
      const rim = new THREE.DirectionalLight(0xd6e4ff, 1);
      rim.position.set(-1, -0.6, 0.8);
      const sky = new THREE.HemisphereLight(0xffffff, 0x848ea4, 1.9);
      sky.position.set(0, 0, 1);
      this.renderer.shadowMap.enabled = true;
      this.scene.add(key, key.target, rim, sky);
      const plane = new THREE.PlaneGeometry(20 * data.radius, 20 * data.radius);
      const shade = new THREE.Mesh(plane, new THREE.ShadowMaterial({ opacity: 0.22 }));
      shade.position.z = data.floor;
      shade.receiveShadow = true;
      this.scene.add(shade);
    }

    colours(name) {
      const [ground, cell, section] = GROUND[name];
      this.scene.background = new THREE.Color(ground);
      this.scene.fog = new THREE.Fog(ground, 5 * data.radius, 13 * data.radius);
      this.grid?.removeFromParent();
      const unit = data.radius < 0.6 ? 0.1 : 0.25;
      const count = 2 * Math.ceil(8 * data.radius / unit);
      this.grid = new THREE.GridHelper(count * unit, count, section, cell);
      this.grid.rotation.x = Math.PI / 2;
      this.grid.position.z = data.floor - 1e-4;
      this.scene.add(this.grid);
      this.draw();
    }

    // The way of the tool, from the configurations of the program.
    path() {
      const points = data.program.q.map((q) => { const T = fk(q); return new THREE.Vector3(T[3], T[7], T[11]); });
      return new THREE.Line(new THREE.BufferGeometry().setFromPoints(points), new THREE.LineBasicMaterial({ color: 0xd55e00 }));
    }

    show(poses) {
      this.links.forEach((link, i) => place(link, poses[i]));
      this.draw();
    }

    showFrames(on) {
      for (const frame of this.frames) frame.visible = on;
      this.draw();
    }

    fit() {
      const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentElement;
      const half = Math.tan(this.camera.fov * Math.PI / 360);
      const distance = 1.12 * data.radius / Math.sin(Math.atan(half * Math.min(1, width / Math.max(height, 1))));
      const from = new THREE.Vector3(0.80, 0.92, 0.46).normalize().multiplyScalar(distance);
      this.controls.target.set(...data.center);
      this.camera.position.copy(this.controls.target).add(from);
      this.controls.update();
      this.draw();
    }

    // A turn by angles about the vertical, and up or down.
    turn(around, up) {
      const away = this.camera.position.clone().sub(this.controls.target);
      const radius = away.length();
      const height = clamp(Math.asin(away.z / radius) + up, -1.5, 1.5);
      const angle = Math.atan2(away.y, away.x) + around;
      away.set(Math.cos(height) * Math.cos(angle), Math.cos(height) * Math.sin(angle), Math.sin(height)).multiplyScalar(radius);
      this.camera.position.copy(this.controls.target).add(away);
      this.controls.update();
    }

    zoom(factor) {
      this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
      this.controls.update();
    }

    resize() {
      const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentElement;
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / Math.max(height, 1);
      this.camera.updateProjectionMatrix();
      this.draw();
    }

    draw() {
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; this.renderer.render(this.scene, this.camera); });
    }
  }

  function build() {
    try {
      return new Scene(find("#scene canvas"));
    } catch {
      find("#no-scene").hidden = false; // the only cause in a page that is whole: no WebGL
      return null;
    }
  }

  const scene = build();

  // ---- The panel ----

  function node(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  // Sign of a key's step of one degree or millimetre, and how many.
  const STEPS = {
    ArrowLeft: [-1, 1], ArrowDown: [-1, 1], ArrowRight: [1, 1], ArrowUp: [1, 1], PageDown: [-1, 10], PageUp: [1, 10],
  };

  const rows = robot.joints.map((joint, i) => {
    const slider = node("input", { type: "range", step: "any", min: joint.lower, max: joint.upper, "aria-label": joint.name });
    const field = node("input", { type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": `${joint.name}, exact value` });
    const unit = node("span");
    const error = node("p", { role: "alert", hidden: "" });
    const label = node("label", { title: joint.name }, joint.name);
    const row = node("div", { class: "joint" }, label, slider, field, unit, error);
    row.style.setProperty("--of", `rgb(${joint.color})`);
    find("#joints").append(row);
    slider.addEventListener("input", () => { pause(); move(i, clamp(Number(slider.value), joint.lower, joint.upper)); });
    // Without this the keys of a slider move it by a hundredth of its range.
    slider.addEventListener("keydown", (event) => {
      const [sign, far] = STEPS[event.key] ?? [0, 1];
      if (!sign || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      const size = (joint.turns ? Math.PI / 180 : 0.001) * far * (event.shiftKey ? 0.1 : 1);
      pause();
      move(i, clamp(state.q[i] + sign * size, joint.lower, joint.upper));
    });
    const typed = () => {
      const value = read(field.value, joint.turns);
      const [low, high] = [joint.lower, joint.upper].map((limit) => withUnit(limit, joint.turns));
      const half = 0.5 / 10 ** decimalsOf(joint.turns) / scaleOf(joint.turns); // what the limits on screen are rounded by
      const wrong = value === null || value < joint.lower - half || value > joint.upper + half;
      field.setAttribute("aria-invalid", wrong);
      error.hidden = !wrong;
      error.textContent = wrong ? `A number from ${low} to ${high}.` : "";
      if (!wrong) { pause(); move(i, clamp(value, joint.lower, joint.upper)); }
    };
    field.addEventListener("change", typed);
    field.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      field.setAttribute("aria-invalid", false);
      error.hidden = true;
      field.blur();
      show();
    });
    return { slider, field, unit };
  });

  const cells = robot.rows.map((row) => {
    const line = node("tr", {}, node("th", { scope: "row" }, row.name));
    const made = ["theta", "d", "a", "alpha"].map((name) => {
      const cell = node("td");
      if (row.moves === name) cell.dataset.moves = "";
      line.append(cell);
      return cell;
    });
    find("#rows table").append(line);
    return made;
  });

  function heads() {
    const angle = state.degrees ? "°" : "rad";
    const names = ["row", `θ (${angle})`, `d (${data.units.length})`, `a (${data.units.length})`, `α (${angle})`];
    find("#rows thead")?.remove();
    find("#rows table").prepend(node("thead", {}, node("tr", {}, ...names.map((name) => node("th", { scope: "col" }, name)))));
  }

  const pose = ["x", "y", "z", "roll", "pitch", "yaw"].map((name) => {
    const value = node("dd");
    find("#pose").append(node("div", {}, node("dt", {}, name), value));
    return value;
  });

  let describing = 0;

  function describe(numbers) {
    clearTimeout(describing);
    describing = setTimeout(() => {
      const point = numbers.slice(0, 3).map((value, k) => `${"xyz"[k]} ${written(value, false)}`).join(", ");
      const joints = robot.joints.map((joint, i) => `${joint.name} ${withUnit(state.q[i], joint.turns)}`).join(", ");
      find("#scene canvas").setAttribute("aria-label", `${data.title}. Tool at ${point} ${data.units.length}. ${joints}.`);
    }, 300);
  }

  // Shows the state; a field that is being typed into keeps its text.
  function show() {
    const poses = linkPoses(state.q);
    scene?.show(poses);
    rows.forEach(({ slider, field, unit }, i) => {
      const joint = robot.joints[i];
      slider.value = state.q[i];
      slider.setAttribute("aria-valuetext", withUnit(state.q[i], joint.turns));
      unit.textContent = unitOf(joint.turns);
      if (document.activeElement !== field) field.value = written(state.q[i], joint.turns);
    });
    const T = product(poses.at(-1), robot.tool);
    const numbers = [T[3], T[7], T[11], ...rollPitchYaw(T)];
    pose.forEach((cell, k) => { cell.textContent = withUnit(numbers[k], k > 2); });
    cells.forEach((line, k) => {
      const row = robot.rows[k];
      ["theta", "d", "a", "alpha"].forEach((name, j) => {
        const value = row[name] + (row.moves === name ? row.ratio * state.q[row.joint] : 0);
        line[j].textContent = written(value, name === "theta" || name === "alpha");
      });
    });
    describe(numbers);
  }

  function move(i, value) {
    state.q[i] = value;
    choose(-1);
    show();
  }

  function go(q) {
    state.q = q.slice();
    show();
  }

  // ---- Postures ----

  function choose(k) {
    state.posture = k;
    if (!data.target) return;
    const { postures } = data.target;
    const chosen = postures[k];
    find("#posture").textContent = chosen ? `${k + 1} of ${postures.length}: ${chosen.name}` : `none of ${postures.length} chosen`;
  }

  function step(by) {
    const { length } = data.target.postures;
    const k = state.posture < 0 ? (by > 0 ? 0 : length - 1) : (state.posture + by + length) % length;
    pause();
    choose(k);
    go(data.target.postures[k].q);
  }

  if (data.target) {
    find("#target").hidden = false;
    find("#reason").textContent = data.target.reason;
    find("#steps").hidden = !data.target.postures.length;
    choose(-1);
  }

  // ---- Program ----

  const clock = find("#program output");
  const slide = find("#program input");
  let last = 0;

  function at(time) {
    const { q, times } = data.program;
    let k = 0;
    let end = times.length - 1;
    while (end - k > 1) { const middle = (k + end) >> 1; if (times[middle] <= time) k = middle; else end = middle; }
    const share = clamp((time - times[k]) / (times[end] - times[k] || 1), 0, 1);
    return q[k].map((value, i) => value + share * (q[end][i] - value));
  }

  function seek(time) {
    const duration = data.program.times.at(-1);
    state.time = clamp(time, 0, duration);
    slide.value = state.time;
    clock.textContent = `${state.time.toFixed(2)} of ${duration.toFixed(2)} s`;
    choose(-1);
    go(at(state.time));
  }

  function pause() {
    state.playing = false;
    find("[data-do=play]").textContent = "Play";
  }

  function tick(now) {
    if (!state.playing) return;
    seek(state.time + (now - last) / 1000);
    last = now;
    if (state.time >= data.program.times.at(-1)) pause();
    else requestAnimationFrame(tick);
  }

  function play() {
    if (state.playing) { pause(); return; }
    if (state.time >= data.program.times.at(-1)) state.time = 0;
    state.playing = true;
    find("[data-do=play]").textContent = "Pause";
    last = performance.now();
    requestAnimationFrame(tick);
  }

  if (data.program) {
    const numbers = new Float64Array(bytes(data.program.q));
    data.program.q = data.program.times.map((_, k) => [...numbers.subarray(k * robot.joints.length, (k + 1) * robot.joints.length)]);
    find("#program").hidden = false;
    find("#program-title").textContent = data.program.name;
    slide.max = data.program.times.at(-1);
    clock.textContent = `0.00 of ${data.program.times.at(-1).toFixed(2)} s`;
    slide.addEventListener("input", () => { pause(); seek(Number(slide.value)); });
    scene?.scene.add(scene.path());
  }

  // ---- What the buttons and keys do ----

  const actions = {
    fit: () => scene?.fit(),
    frames: () => {
      state.frames = !state.frames;
      find("[data-do=frames]").setAttribute("aria-pressed", state.frames);
      scene?.showFrames(state.frames);
    },
    saved: () => { pause(); choose(-1); go(data.q); },
    home: () => { pause(); choose(-1); go(robot.joints.map((joint) => joint.home)); },
    before: () => step(-1),
    next: () => step(1),
    play,
  };
  document.addEventListener("click", (event) => actions[event.target.closest("[data-do]")?.dataset.do]?.());

  const TURN = Math.PI / 24;
  const keys = {
    ArrowLeft: () => scene?.turn(-TURN, 0), ArrowRight: () => scene?.turn(TURN, 0), ArrowUp: () => scene?.turn(0, TURN),
    ArrowDown: () => scene?.turn(0, -TURN), "+": () => scene?.zoom(0.9), "-": () => scene?.zoom(1 / 0.9), f: actions.fit,
  };
  find("#scene canvas").addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });

  find("[data-choose=angle]").value = state.degrees ? "deg" : "rad";
  find("[data-choose=angle]").addEventListener("change", (event) => {
    state.degrees = event.target.value === "deg";
    heads();
    show();
  });

  const system = matchMedia("(prefers-color-scheme: dark)");
  function colours() {
    const name = find("[data-choose=colours]").value || (system.matches ? "dark" : "light");
    document.documentElement.dataset.colours = name;
    scene?.colours(name);
  }
  system.addEventListener("change", colours);
  find("[data-choose=colours]").addEventListener("change", colours);

  find("#convention").textContent = robot.convention;
  heads();
  colours();
  if (scene) {
    new ResizeObserver(() => scene.resize()).observe(find("#scene"));
    scene.resize();
    scene.fit();
  }
  show();
  // For scripts beside this one: forward kinematics as the page computes it.
  window.kinboardArm = { fk, q: () => state.q.slice() };
})();
