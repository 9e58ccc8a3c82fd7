"use strict";
// A saved page of one arm: its sliders, its target, its postures and its program, without a server. What it shows is in
// the element #data, which app/viewer/takehome wrote; lengths there are metres and angles radians, whatever is on screen.
// An arm whose kernels can be generated solves for its target here (solver.js); another one shows what was saved.
(async () => {
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

  // The pose with a roll, pitch and yaw at a point: Rz(yaw) Ry(pitch) Rx(roll).
  function poseAt([x, y, z, roll, pitch, yaw]) {
    const [ca, sa, cb, sb, cc, sc] = [roll, pitch, yaw].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
    return [
      cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa, x, sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa, y,
      -sb, cb * sa, cb * ca, z, 0, 0, 0, 1,
    ];
  }

  const sixOf = (T) => [T[3], T[7], T[11], ...rollPitchYaw(T)];

  const { read, scaleOf, decimalsOf, sentence, unitOf, withUnit, written } = kinboard.numbers(data.units);
  const solver = data.solver && kinboard.solver(kernels, data.solver, fk);
  const words = data.solver && kinboard.words(data.solver, sentence);
  const state = {
    q: data.q.slice(), target: data.target?.pose ?? (solver && fk(data.q)), saved: Boolean(data.target), found: null, chosen: -1,
    value: null, frames: false, ghosts: true, time: 0, playing: false,
  };
  // The kernels write names of branches in plain letters.
  for (const each of (solver && data.target?.postures) || []) {
    each.branch = kernels.branches[data.solver.branches.findIndex(([name]) => name === each.branch)];
  }

  // ---- The scene ----

  function bytes(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  }

  // Rows of three whole numbers, of which the file has the differences, deflated.
  async function unpacked(text, Kind) {
    const packed = new Blob([bytes(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
    const found = new Kind(await new Response(packed).arrayBuffer());
    for (let i = 3; i < found.length; i++) found[i] += found[i - 3];
    return found;
  }

  await Promise.all(data.parts.map(async (part) => {
    part.vertices = await unpacked(part.vertices, Uint16Array);
    part.faces = await unpacked(part.faces, part.wide ? Uint32Array : Uint16Array);
  }));

  function geometry(part) {
    const points = new Float32Array(part.vertices.length);
    for (let i = 0; i < points.length; i++) points[i] = part.low[i % 3] + part.vertices[i] * part.step[i % 3];
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.BufferAttribute(points, 3));
    made.setIndex(new THREE.BufferAttribute(part.faces, 1));
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
      if (state.target) this.addTarget(canvas);
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
      this.ghosts = [];
      this.fit();
    }

    // The frame of the target, with arrows or rings to drag it where the page solves. They are asked for the pointer
    // before the view is, which they stop from turning.
    addTarget(canvas) {
      this.target = axes(data.size * 4, data.size * 0.12);
      this.scene.add(this.target);
      if (!solver) return;
      this.grip = new THREE.TransformControls(this.camera, canvas);
      this.grip.setSize(0.7);
      this.grip.attach(this.target);
      this.scene.add(this.grip.getHelper());
      this.grip.addEventListener("dragging-changed", ({ value }) => { this.controls.enabled = !value; });
      this.grip.addEventListener("change", () => this.draw());
      this.grip.addEventListener("objectChange", () => {
        this.target.updateMatrix();
        const e = this.target.matrix.elements; // by columns
        aim([e[0], e[4], e[8], e[12], e[1], e[5], e[9], e[13], e[2], e[6], e[10], e[14], 0, 0, 0, 1]);
      });
    }

    showTarget(T) {
      this.target.matrix.set(...T).decompose(this.target.position, this.target.quaternion, this.target.scale);
      this.draw();
    }

    turnTarget(on) {
      this.grip.setMode(on ? "rotate" : "translate");
      this.grip.setSpace(on ? "local" : "world");
    }

    // The arm in other postures, pale; link by link as the arm itself, but for what stands still.
    showGhosts(configurations) {
      while (this.ghosts.length < configurations.length) this.ghosts.push(this.ghost());
      this.ghosts.forEach((links, k) => {
        const poses = configurations[k] && linkPoses(configurations[k]);
        links.forEach((link, i) => {
          link.visible = Boolean(poses);
          if (poses) place(link, poses[i + 1]);
        });
      });
      this.draw();
    }

    ghost() {
      this.pale ??= new THREE.MeshStandardMaterial({ color: 0x7d8a97, transparent: true, opacity: 0.16, depthWrite: false });
      const links = this.links.slice(1).map((link) => {
        const group = new THREE.Group();
        for (const { geometry: shape, matrix, matrixAutoUpdate } of link.children.filter((child) => child.isMesh)) {
          const mesh = new THREE.Mesh(shape, this.pale);
          mesh.matrixAutoUpdate = matrixAutoUpdate;
          mesh.matrix.copy(matrix);
          group.add(mesh);
        }
        return group;
      });
      this.scene.add(...links);
      return links;
    }

    light() {
      const key = new THREE.DirectionalLight(0xfffcf6, 2.6);
      const middle = new THREE.Vector3(...data.center);
      key.position.copy(new THREE.Vector3(0.95, -0.15, 1.6).normalize().multiplyScalar(5 * data.radius).add(middle));
      key.target.position.copy(middle);
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

  const REST = 150; // ms without a new target: the pointer rests
  const QUICK = 30; // ms of a frame
  const FAR = 1000; // m, of a target
  // Sign of a key's step of one degree or millimetre, and how many.
  const STEPS = {
    ArrowLeft: [-1, 1], ArrowDown: [-1, 1], ArrowRight: [1, 1], ArrowUp: [1, 1], PageDown: [-1, 10], PageUp: [1, 10],
  };

  // Has the keys of STEPS, but for some, move a value: shift(by) gets how far.
  function steps(field, turns, shift, others = []) {
    field.addEventListener("keydown", (event) => {
      const [sign, far] = STEPS[event.key] ?? [0, 1];
      if (!sign || others.includes(event.key) || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      shift(sign * (turns ? Math.PI / 180 : 0.001) * far * (event.shiftKey ? 0.1 : 1));
    });
  }

  // A field for a number, between two limits if there are any; set(value) takes what was typed.
  function numberField(name, turns, [low, high], value, set) {
    const field = node("input", { type: "text", inputmode: low < 0 ? "text" : "decimal", autocomplete: "off", "aria-label": name });
    const unit = node("span");
    const error = node("p", { role: "alert", hidden: "" });
    const accept = (wrong) => {
      field.setAttribute("aria-invalid", wrong);
      error.hidden = !wrong;
    };
    field.addEventListener("change", () => {
      const typed = read(field.value, turns, [low, high]);
      const half = 0.5 / 10 ** decimalsOf(turns) / scaleOf(turns); // what the limits on screen are rounded by
      const wrong = typed === null || typed < low - half || typed > high + half;
      accept(wrong);
      const range = Number.isFinite(high - low) ? ` from ${withUnit(low, turns)} to ${withUnit(high, turns)}` : "";
      const point = field.value.includes(",") ? ", with a point for decimals" : "";
      error.textContent = wrong ? `A number${range}${point}.` : "";
      if (wrong) return;
      set(clamp(typed, low, high));
      field.value = written(value(), turns);
    });
    field.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      accept(false);
      field.blur();
      show();
    });
    function refresh() {
      unit.textContent = unitOf(turns);
      if (document.activeElement !== field) field.value = written(value(), turns);
    }
    return { field, unit, error, refresh };
  }

  // A slider and a field for a number between two limits, in a row.
  function sliderRow(row, label, turns, [low, high], value, set) {
    const slider = node("input", { type: "range", step: "any", min: low, max: high, "aria-label": label });
    const number = numberField(`${label}, exact value`, turns, [low, high], value, set);
    row.append(node("label", { title: label }, label), slider, number.field, number.unit, number.error);
    slider.addEventListener("input", () => set(clamp(Number(slider.value), low, high)));
    // Without this the keys of a slider move it by a hundredth of its range.
    steps(slider, turns, (by) => set(clamp(value() + by, low, high)));
    return { slider, ...number };
  }

  const rows = robot.joints.map(({ lower, upper, name, turns, color }, i) => {
    const row = node("div", { class: "joint" });
    row.style.setProperty("--of", `rgb(${color})`);
    find("#joints").append(row);
    return sliderRow(row, name, turns, [lower, upper], () => state.q[i], (value) => move(i, value));
  });

  const cells = [...document.querySelectorAll("#rows tbody tr")].map((row) => row.querySelectorAll("td"));
  const pose = document.querySelectorAll("#pose dd");
  function heads() {
    for (const unit of document.querySelectorAll("#rows thead span")) unit.textContent = unitOf("turns" in unit.dataset);
  }

  let describing = 0;

  function describe(shown) {
    clearTimeout(describing);
    describing = setTimeout(() => {
      const point = shown.slice(0, 3).map((value, k) => `${"xyz"[k]} ${written(value, false)}`).join(", ");
      const joints = robot.joints.map((joint, i) => `${joint.name} ${withUnit(state.q[i], joint.turns)}`).join(", ");
      find("#scene canvas").setAttribute("aria-label", `${data.title}. Tool at ${point} ${data.units.length}. ${joints}.`);
    }, 300);
  }

  // Shows the state; a field that is being typed into keeps its text.
  function show() {
    const poses = linkPoses(state.q);
    scene?.show(poses);
    rows.forEach(({ slider, refresh }, i) => {
      slider.value = state.q[i];
      slider.setAttribute("aria-valuetext", withUnit(state.q[i], robot.joints[i].turns));
      refresh();
    });
    const T = product(poses.at(-1), robot.tool);
    const shown = sixOf(T);
    pose.forEach((cell, k) => { cell.textContent = withUnit(shown[k], k > 2); });
    cells.forEach((line, k) => {
      const row = robot.rows[k];
      ["theta", "d", "a", "alpha"].forEach((name, j) => {
        const value = row[name] + (row.moves === name ? row.ratio * state.q[row.joint] : 0);
        line[j].textContent = written(value, name === "theta" || name === "alpha");
      });
    });
    if (state.target) scene?.showTarget(state.target);
    for (const { refresh } of aims) refresh();
    showPostures();
    describe(shown);
  }

  // ---- Target and postures ----

  // The six numbers of the target, where the page solves for it.
  const aims = !solver ? [] : ["x", "y", "z", "roll", "pitch", "yaw"].map((name, k) => {
    const set = (value) => aim(poseAt(sixOf(state.target).with(k, value)));
    const made = numberField(`target ${name}`, k > 2, k > 2 ? [-Infinity, Infinity] : [-FAR, FAR], () => sixOf(state.target)[k], set);
    steps(made.field, k > 2, (by) => {
      set(sixOf(state.target)[k] + by);
      made.field.value = written(sixOf(state.target)[k], k > 2);
    }, ["ArrowLeft", "ArrowRight"]);
    find("#aim").append(node("div", { class: "aim" }, node("label", {}, name), made.field, made.unit, made.error));
    return made;
  });

  let waiting = false;
  let leads = false; // whether the arm goes where the target leads it, to the posture that is nearest to where it is
  let resting = 0;
  let searching = 0; // for the bar of values
  let took = 0; // ms, to find what comes closest

  // A new target: solved for at the next frame, so at most once a frame.
  function aim(T) {
    pause();
    Object.assign(state, { target: T, value: null, saved: false });
    if (free) free.error.hidden = true;
    leads = true;
    solveSoon();
  }

  // The target follows the tool when joints are moved.
  function follow() {
    if (!solver) return;
    Object.assign(state, { target: fk(state.q), value: null, saved: false });
    if (free) free.error.hidden = true;
    leads = false;
    if (state.playing) state.found = null;
    else solveSoon();
  }

  function solveSoon() {
    clearTimeout(resting);
    clearTimeout(searching);
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; solve(); });
  }

  function solve() {
    if (state.playing) return;
    // What else was asked of the saved target, such as clear of obstacles, only its saved answer knows.
    if (state.saved && data.target.plain === false) {
      if (free) showFree();
      return;
    }
    state.found = solver.answer(state.target, state.q, state.value);
    const reached = ["solved", "approximate"].includes(state.found.status);
    if (reached && leads) state.q = state.found.rows[0].q;
    if (reached && data.solver.parameter) resting = setTimeout(() => { showValue(); showBar(); }, REST);
    // Arms with few joints seldom meet a whole pose: they follow the point as it is dragged, where that is quick.
    if (!reached && data.solver.few && leads && took < QUICK) rest();
    else if (!reached && !state.saved) resting = setTimeout(rest, REST);
    show();
  }

  // Where the pointer rests on a target without a configuration, the arm comes as close to it as it can.
  function rest() {
    const start = performance.now();
    const found = solver.why(state.target, state.q, state.found);
    took = performance.now() - start;
    state.found = found;
    state.q = (found.closest ?? found.rows[0]).q;
    show();
    if (free) showFree();
  }

  // In the order of the branches, whichever is nearest.
  function postures() {
    if (state.found) return state.found.rows.toSorted((a, b) => a.row - b.row);
    return solver && !state.saved ? [] : data.target?.postures ?? [];
  }
  const isShown = ({ q }) => q.every((value, i) => Math.abs(value - state.q[i]) < 1e-6);
  // Lines break between the parts of a name.
  const nameOf = (row) => (row.name ?? data.solver.branches[row.row]?.[1] ?? "found by search")
    .replace(/ (?=[+\u2212])/g, "\u00a0").replace(/-/g, "\u2011");
  const reason = () => {
    if (state.saved || !solver) return data.target?.reason ?? "";
    return state.found ? words.text(state.found) || "No configuration meets this target." : "";
  };

  // The list of postures; built anew only where others are in it, so that a button keeps the focus.
  function showPostures() {
    const list = find("#postures");
    const all = postures();
    const outside = state.found?.status === "limits";
    const text = reason();
    if (find("#status").textContent !== text) find("#status").textContent = text;
    find("#status").hidden = !text;
    find("#status").dataset.status = state.found?.status ?? "saved";
    const key = JSON.stringify([outside, all.map(nameOf)]);
    if (list.dataset.key !== key) {
      list.dataset.key = key;
      list.replaceChildren(...all.map((row, k) => {
        const button = node("button", { type: "button" }, nameOf(row));
        button.disabled = outside;
        button.addEventListener("click", () => pick(k));
        return node("li", {}, button);
      }));
    }
    state.chosen = all.findIndex(isShown);
    [...list.querySelectorAll("button")].forEach((button, k) => {
      button.setAttribute("aria-pressed", k === state.chosen);
      button.title = outside ? all[k].beyond.map(words.need).join(", ") : "";
    });
    scene?.showGhosts(state.ghosts && !outside ? all.filter((_, k) => k !== state.chosen).map(({ q }) => q) : []);
  }

  function pick(k) {
    pause();
    state.q = postures()[k].q.slice();
    show();
    if (data.solver?.parameter) showFree();
  }

  function move(i, value) {
    pause();
    state.q[i] = value;
    follow();
    show();
  }

  function go(q) {
    state.q = q.slice();
    follow();
    show();
  }

  // ---- The redundancy parameter: a slider, and the values that the limits allow ----

  const free = data.solver?.parameter && freeSlider(data.solver.parameter);

  function freeSlider({ label, low, high }) {
    find("#free").hidden = false;
    const row = sliderRow(find("#free .joint"), label, true, [low, high], () => Number(row.slider.value), hold);
    return row;
  }

  // Another value while the tool stays: the arm keeps its posture, by name, if it has it there.
  function hold(value) {
    pause();
    const now = postures()[state.chosen]?.branch;
    const found = solver.answer(state.target, state.q, value);
    free.slider.value = value;
    if (found.status === "solved") {
      // Without intervals, branches are numbered anew at each value: the nearest goes on.
      const same = kernels.intervals && found.rows.find(({ branch }) => branch === now);
      Object.assign(state, { value, found, saved: false, q: (same || found.rows[0]).q });
      free.error.hidden = true;
    } else {
      free.error.hidden = false;
      free.error.textContent = `The limits do not allow ${withUnit(value, true)} at this target.`;
    }
    show();
    showFree();
  }

  // The value of the posture on show and the bar; one that must be searched for waits until the slider rests.
  function showFree() {
    showValue();
    clearTimeout(searching);
    if (kernels.intervals) showBar();
    else searching = setTimeout(showBar, REST);
  }

  function showValue() {
    const row = postures()[state.chosen];
    const { joint } = data.solver.parameter;
    if (row) free.slider.value = state.value ?? solver.valueAt(state.target, row);
    else if (joint >= 0) free.slider.value = state.q[joint];
    free.slider.setAttribute("aria-valuetext", withUnit(Number(free.slider.value), true));
    free.refresh();
  }

  // The bar of values that the limits allow in the posture on show, or in any where postures have no lasting names.
  function showBar() {
    const row = postures()[state.chosen];
    const { low, high } = data.solver.parameter;
    const allowed = row ? solver.intervals(state.target, state.q, row.branch) : [];
    const percent = (value) => 100 * clamp((value - low) / (high - low), 0, 1);
    find("#free .track").replaceChildren(...allowed.map(([from, to]) => {
      const bar = node("span");
      bar.style.left = `${percent(from)}%`;
      bar.style.width = `max(2px, ${percent(to) - percent(from)}%)`;
      return bar;
    }));
    const listed = allowed.slice(0, 4).map(([from, to]) => `${written(from, true)} … ${withUnit(to, true)}`).join(", ");
    find("#free .quiet").textContent = listed ? `feasible: ${listed}` : "no value is feasible";
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
    go(at(state.time));
  }

  function pause() {
    if (!state.playing) return;
    state.playing = false;
    find("[data-do=play]").textContent = "Play";
    follow();
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
    ghosts: () => {
      state.ghosts = !state.ghosts;
      find("[data-do=ghosts]").setAttribute("aria-pressed", state.ghosts);
      showPostures();
    },
    turn: () => {
      const on = find("[data-do=turn]").getAttribute("aria-pressed") !== "true";
      find("[data-do=turn]").setAttribute("aria-pressed", on);
      scene?.turnTarget(on);
    },
    saved: () => {
      pause();
      go(data.q);
      if (data.target) Object.assign(state, { target: data.target.pose, saved: true, found: null });
      show();
    },
    home: () => { pause(); go(robot.joints.map((joint) => joint.home)); },
    tool: () => { pause(); go(state.q); },
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

  find("[data-choose=angle]").value = data.units.degrees ? "deg" : "rad";
  find("[data-choose=angle]").addEventListener("change", (event) => {
    data.units.degrees = event.target.value === "deg";
    heads();
    show();
    if (free && state.target) showFree();
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
  find("#target").hidden = !state.target;
  for (const each of document.querySelectorAll("[data-needs]")) each.hidden = !{ solver, target: state.target }[each.dataset.needs];
  if (solver) find("#target-title").textContent = "Target";
  if (solver) solveSoon();
  show();
  // For scripts beside this one: what the page computes and shows, and where the arm is to go.
  window.kinboardArm = {
    fk, linkPoses, scene, q: () => state.q.slice(), target: () => state.target, found: () => state.found, go: (q) => { pause(); go(q); },
  };
})();
