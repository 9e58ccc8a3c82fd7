"use strict";
// Inverse kinematics of a saved page: what kin.ik does after the kernels, which kin.generate wrote for this arm.
(() => {
  const REACHED = 1e-7; // m, at which a descent has reached a point
  const SAME = 1e-6; // m, lengths that count as equal when a point is judged too far or too near
  const WIDE = 1e-7; // rad, an interval that is more than a value
  const SUSPECT = 1e-4; // of a pivot: configurations may be on a curve
  const STEP = Math.PI / 90; // between values of a redundancy parameter whose intervals are not known

  const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
  const minus = (a, b) => a.map((x, i) => x - b[i]);
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const pointOf = (T) => [T[3], T[7], T[11]];

  // kernels: the generated constant; about: what app/viewer/takehome wrote of the arm; fk(q): 16 numbers by rows.
  kinboard.solver = (kernels, about, fk) => {
    const { parameter } = about;
    const lower = about.lower.map((x) => x ?? -Infinity);
    const upper = about.upper.map((x) => x ?? Infinity);

    // The configurations of a pose: {status, rows, …}, where "unmet" leaves to `why` what comes closest. value: the one
    // that the redundancy parameter is held at; null: the nearest to the seed's.
    function answer(T, seed, value = null) {
      const { status, solutions } = value === null ? kernels.ik(T, seed) : kernels.ik_at(T, value, seed);
      const rows = solutions.map((each) => ({ ...each, row: kernels.branches.indexOf(each.branch) }));
      const held = parameter && !kernels.intervals && status === "solved" ? rows[0].q[parameter.joint] : value;
      const found = { status, rows, held };
      if (status === "limits") for (const each of rows) each.beyond = beyond(each.q);
      if (status === "solved" && !parameter) found.complete = about.complete && !rows.some(({ q }) => isSingular(q));
      if (status === "solved" && held === null && parameter) found.free = intervals(T, seed).some(([low, high]) => high - low > WIDE);
      return found;
    }

    // Where no configuration is inside the limits: what comes closest, and why nothing comes closer.
    function why(T, seed, found) {
      const { status, ...closest } = kernels.nearest(T, seed);
      if (status === "solved") return { status, rows: [closest], complete: false };
      if (found.status === "limits") return { ...found, closest };
      const nearest = kernels.nearest(T, seed, true); // the point first, then the orientation
      if (nearest.position_error > REACHED) {
        return { status: "unreachable", rows: [], closest, distance: nearest.position_error, cause: sideOf(pointOf(T), nearest.q) };
      }
      return about.few ? { status: "rotation", rows: [], closest: nearest } : { status: "orientation", rows: [], closest, nearest };
    }

    const beyond = (q) => q.flatMap((value, joint) => {
      const limit = value < lower[joint] ? lower[joint] : upper[joint];
      return value < lower[joint] || value > upper[joint] ? [{ joint, value, limit }] : [];
    });

    // Whether some motion of the joints hardly moves the tool: pivots of the Jacobian, the longest column first.
    function isSingular(q) {
      const J = kernels.jacobian(q);
      let left = q.map((_, j) => J.map((row, r) => (r < 3 ? row[j] / about.size : row[j])));
      while (left.length) {
        const [first, ...others] = left.sort((a, b) => dot(b, b) - dot(a, a));
        const size = Math.hypot(...first);
        if (size < SUSPECT) return true;
        left = others.map((column) => {
          const along = dot(column, first) / size ** 2;
          return column.map((x, r) => x - along * first[r]);
        });
      }
      return false;
    }

    // As `side_of` in kin.ik.failures; q is the configuration that comes nearest to the point.
    function sideOf(point, q) {
      const { axis, at } = about.shoulder;
      const shoulder = at.map((x, i) => x + (about.slides ? axis[i] * (q[0] - about.home[0]) : 0));
      const across = (v) => minus(v, axis.map((x) => x * dot(axis, v)));
      const reached = minus(pointOf(fk(q)), shoulder);
      const target = minus(point, shoulder);
      const [far, near] = [Math.hypot(...target), Math.hypot(...reached)];
      if (far > near + SAME) return "too far";
      const out = minus(reached, target);
      const away = far > 1e-9 ? dot(out, target) / far : Infinity;
      const hole = Math.hypot(...across(reached)) > Math.hypot(...across(target)) + SAME;
      if (about.turns && hole && Math.hypot(...across(out)) > away - 1e-9) return "around the axis";
      return far < near - SAME ? "too near" : "outside";
    }

    // [low, high] of the redundancy parameter where its limits allow a branch, or any. Where they are not known it is by
    // steps and the seed's value, and always any: branches are numbered anew at each value.
    function intervals(T, seed, branch = null) {
      const on = (row) => branch === null || row.branch === branch;
      if (kernels.intervals) return kernels.intervals(T, seed).filter(on).map(({ low, high }) => [low, high]);
      const { joint, low, high } = parameter;
      const values = Array.from({ length: Math.floor((high - low) / STEP) + 1 }, (_, k) => low + k * STEP);
      const found = [];
      for (const value of [...values, clamp(seed[joint], low, high)].sort((a, b) => a - b)) {
        if (kernels.ik_at(T, value, seed).status !== "solved") continue;
        if (found.length && value - found.at(-1)[1] < 1.5 * STEP) found.at(-1)[1] = value;
        else found.push([value, value]);
      }
      return found;
    }

    // The value of the redundancy parameter at a row of the answer to T: a joint's, or where its branch meets the row.
    function valueAt(T, { q, branch }) {
      if (parameter.joint >= 0) return q[parameter.joint];
      const off = (value) => {
        const row = kernels.ik_at(T, value, q).solutions.find((each) => each.branch === branch);
        return row ? Math.max(...minus(row.q, q).map(Math.abs)) : Infinity;
      };
      let [best, least] = [0, off(0)];
      const look = (value) => {
        const size = off(value);
        if (size < least) [best, least] = [value, size];
      };
      for (let value = parameter.low; value < parameter.high; value += STEP) look(value);
      for (let step = STEP / 2; step > 1e-9; step /= 2) for (const value of [best - step, best + step]) look(value);
      return best;
    }

    return { answer, why, intervals, valueAt };
  };

  // The sentence about an answer. about.words has those of kin.ik.messages with places for what differs: {a1} and
  // {l2} are an angle and a length; sentence(value, turns) writes one.
  kinboard.words = (about, sentence) => {
    const { words, branches } = about;
    const fill = (pattern, values) => pattern.replace(/\{(\w+)\}/g, (place, name) => {
      const key = name.replace(/^[al](?=\d$)/, "");
      if (!Object.hasOwn(values, key)) return place; // a part of a joint's name
      return typeof values[key] === "number" ? sentence(values[key], name.startsWith("a")) : values[key];
    });
    const listed = (parts) => fill(words.listed[parts.length - 1], parts);

    function need({ joint, value, limit }) {
      const [apart, close] = words.needs[joint];
      const turns = about.revolute[joint];
      if (sentence(value, turns) !== sentence(limit, turns)) return fill(apart, [0, value, limit]);
      return fill(close, [Math.abs(value - limit), 0, limit]);
    }

    function solved({ rows, held, free, complete }) {
      const postures = new Set(rows.map(({ branch }) => branch)).size;
      if (free) return words.free[postures - 1];
      const kind = typeof held === "number" ? words.held : complete === false ? words.found : words.solved;
      return kind[rows.length - 1];
    }

    function text(found) {
      const { status, rows, closest } = found;
      switch (status) {
        case "solved": return solved(found);
        case "approximate": return fill(words.roll, [0, rows[0].rotation_error]);
        case "limits":
          return fill(words.limits[rows.length - 1], { branch: branches[rows[0].row][0], needs: listed(rows[0].beyond.map(need)) });
        case "rotation": return fill(words.rotation, [0, closest.rotation_error]);
        case "orientation":
          return fill(words.orientation, [0, closest.position_error, closest.rotation_error, found.nearest.rotation_error]);
        case "unreachable": return fill(words.unreachable[found.cause], [0, found.distance]);
        default: return "";
      }
    }
    return { need, text };
  };
})();
