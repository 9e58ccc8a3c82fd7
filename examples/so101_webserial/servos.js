"use strict";
// The servos of an SO-101 on a serial port of the browser (WebSerial): their bus, their ticks as joint values, and the bounds
// within which they are led. Registers, sentences and bounds are those of `kinboard so101`, where app/servos/ and
// kin/notebook/driving.py have the reasons. panel.js is the part of the page that its reader sees.
(() => {
  const TAU = 2 * Math.PI;
  const rad = (degrees) => degrees * TAU / 360;
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const written = (angle) => `${(angle * 360 / TAU).toFixed(1).replace("-", "\u2212")}°`;
  const named = ({ id, name }) => `motor ${id} (${name})`;

  const BOUNDS = {
    SAME: 1e-3, // rad by which the page moves a joint
    LATEST: 0.1, // s that count at most between two steps: nothing is caught up after a pause
    BEHIND: rad(25), PATIENCE: 0.5, // rad, s: an arm so far behind for so long is blocked
    AWAY: rad(10), // rad that a joint may move away from where it is asked to be
    MARGIN: 23, // ticks outside its range at which a servo may be switched on
    ANSWER: 0.1, // s that a servo may take to answer
    CYCLE: 0.02, RESTING: 0.5, // s between two readings; between two tries of servos that do not answer
  };

  class StoppedError extends Error {} // the arm was not moved, or not any further
  class BusError extends StoppedError {}
  class SilentError extends BusError {} // of a servo that does not answer

  // ---- Packets ----

  const [MODEL, HOTTEST, TORQUE, GOAL, PRESENT, VOLTAGE] = [3, 13, 40, 42, 56, 62]; // registers
  const [PING, READ, WRITE, SYNC_WRITE, EVERYBODY] = [0x01, 0x02, 0x03, 0x83, 0xfe];
  const [BAUD, TURN] = [1_000_000, 4096];
  const MODELS = { 777: "STS3215", 2825: "STS3250" };
  const ERRORS = ["voltage", "encoder", "temperature", "current", "", "overload"]; // bits of a status packet

  const checksum = (bytes) => ~bytes.reduce((sum, byte) => sum + byte, 0) & 0xff;
  const word = ([low, high]) => low + 256 * high;

  function packet(id, instruction, ...parameters) {
    const inside = [id, parameters.length + 2, instruction, ...parameters];
    return new Uint8Array([0xff, 0xff, ...inside, checksum(inside)]);
  }

  // One packet with a goal for each [id, tick], which no servo answers.
  const goals = (ticks) => packet(EVERYBODY, SYNC_WRITE, GOAL, 2, ...ticks.flatMap(([id, tick]) => [id, tick & 0xff, tick >> 8]));

  // The first whole status packet of a servo with so many values among bytes, as { error, values }, or null.
  function status(bytes, id, count) {
    for (let i = 0; i + 6 + count <= bytes.length; i++) {
      const inside = bytes.slice(i + 2, i + 5 + count);
      const begins = bytes[i] === 0xff && bytes[i + 1] === 0xff && inside[0] === id && inside[1] === count + 2;
      if (begins && checksum(inside) === bytes[i + 5 + count]) return { error: inside[2], values: inside.slice(3) };
    }
    return null;
  }

  // ---- The bus ----

  const TRIES = 3; // of a packet, before its servo counts as lost

  class Bus {
    // port: of navigator.serial; motors: all that are to be there.
    constructor(port, motors) {
      Object.assign(this, { port, motors, bytes: [], lost: null, closing: false, heard: () => {} });
    }

    async open() {
      try {
        await this.port.open({ baudRate: BAUD });
      } catch (error) {
        throw new BusError(`The port cannot be opened: is another program using it (LeRobot, a serial monitor)? ${error.message}`);
      }
      this.writer = this.port.writable.getWriter();
      this.listening = this.listen();
    }

    // A byte that is broken on the line ends the port's stream, and there is a new one; there is none once the port is gone.
    async listen() {
      let why = "it was unplugged";
      while (this.port.readable && !this.closing) {
        this.reader = this.port.readable.getReader();
        try {
          for (let got = await this.reader.read(); !got.done; got = await this.reader.read()) {
            this.bytes.push(...got.value);
            this.heard();
          }
        } catch (error) {
          why = error.message;
        } finally {
          this.reader.releaseLock();
        }
      }
      if (!this.closing) this.lose(why);
    }

    lose(why) {
      this.lost ??= new BusError(`The port is gone: ${why}`);
      this.heard();
      return this.lost;
    }

    async write(bytes) {
      try {
        await this.writer.write(bytes);
      } catch (error) {
        throw this.lose(error.message);
      }
    }

    // The status packet of a servo; null if none has come in time.
    answer(id, count) {
      return new Promise((done) => {
        const end = (found) => {
          clearTimeout(timer);
          this.heard = () => {};
          done(found);
        };
        const timer = setTimeout(end, 1000 * BOUNDS.ANSWER, null);
        this.heard = () => {
          const found = status(this.bytes, id, count);
          if (found || this.lost) end(found);
        };
        this.heard();
      });
    }

    // The values with which a servo answers; it is asked again if its answer is broken. `tolerant` of the servo's own errors.
    async ask(motor, count, instruction, parameters = [], tolerant = false) {
      for (let k = 0; k < TRIES && !this.lost; k++) {
        this.bytes.length = 0; // what is left of a broken answer
        await this.write(packet(motor.id, instruction, ...parameters));
        const found = await this.answer(motor.id, count);
        if (found?.error && !tolerant) {
          const errors = ERRORS.filter((name, bit) => name && found.error >> bit & 1).join(", ");
          throw new BusError(`${named(motor)} reports an error: ${errors || `bits ${found.error}`}. Switch the arm's power off and on`);
        }
        if (found) return found.values;
      }
      if (this.lost) throw this.lost;
      if (this.bytes.length) throw new BusError(`${named(motor)} answers with broken packets only`);
      throw new SilentError(`${named(motor)} does not answer`);
    }

    read(motor, address, count, tolerant) {
      return this.ask(motor, count, READ, [address, count], tolerant);
    }

    // What all servos are and how they are, as a sentence; an error names each that is missing or not fit to be moved.
    async check() {
      const [missing, found] = [[], []];
      for (const motor of this.motors) {
        try {
          await this.ask(motor, 0, PING);
          const model = word(await this.read(motor, MODEL, 2));
          if (!(model in MODELS)) throw new BusError(`${named(motor)} is of model ${model}: its registers differ`);
          found.push(named(motor));
        } catch (error) {
          if (!(error instanceof SilentError)) throw error;
          missing.push(error.message);
        }
      }
      if (!found.length) throw new BusError("No servo answered: is the arm's power on, and this the arm's port?");
      if (missing.length) {
        throw new BusError(`${missing.join("; ")}. ${found.join(", ")} answered: check the cable from the servo before it`);
      }
      const health = [];
      for (const motor of this.motors) health.push(await this.health(motor));
      const [volts, celsius] = [0, 1].map((k) => health.map((each) => each[k]));
      return `${health.length} servos answer: ${Math.min(...volts).toFixed(1)} V, ${Math.max(...celsius)} °C at most.`;
    }

    // The supply (V) and the temperature (°C) of a servo, inside its own limits.
    async health(motor) {
      const [hottest, highest, lowest] = await this.read(motor, HOTTEST, 3);
      const [supply, celsius] = await this.read(motor, VOLTAGE, 2);
      const [volts, low, high] = [supply, lowest, highest].map((tenths) => (tenths / 10).toFixed(1));
      if (supply < lowest || supply > highest) {
        throw new BusError(`${named(motor)} gets ${volts} V, expected ${low} to ${high} V: is this the arm's own power supply?`);
      }
      if (celsius >= hottest) {
        throw new BusError(`${named(motor)} is at ${celsius} °C, expected less than ${hottest} °C: let it cool down`);
      }
      return [supply / 10, celsius];
    }

    async position(motor, tolerant) {
      const tick = word(await this.read(motor, PRESENT, 2, tolerant));
      if (tick >= TURN) throw new BusError(`${named(motor)} says ${tick}, expected a position from 0 to ${TURN - 1}`);
      return tick;
    }

    async positions(motors) {
      const found = [];
      for (const motor of motors) found.push(await this.position(motor));
      return found;
    }

    // Let servos hold where they are; returns why each of those that cannot be reached cannot.
    async hold(motors) {
      const [found, lost] = [[], new Set()];
      for (const motor of motors) {
        try {
          found.push([motor.id, await this.position(motor, true)]);
        } catch (error) {
          if (!(error instanceof BusError)) throw error;
          lost.add(error.message);
        }
      }
      if (found.length) await this.write(goals(found));
      return [...lost];
    }

    async torque(motors, on) {
      for (const motor of motors) await this.ask(motor, 0, WRITE, [TORQUE, Number(on)]);
    }

    async close() {
      this.closing = true;
      if (this.lost || !this.writer) return;
      await this.reader.cancel();
      await this.listening;
      this.writer.releaseLock();
      await this.port.close();
    }
  }

  // ---- Ticks as joint values ----

  // Motors with their ranges from LeRobot's calibration, whose text is given.
  function calibrated(text, motors) {
    let table;
    try {
      table = JSON.parse(text);
    } catch (error) {
      throw new StoppedError(`Calibration: expected the JSON file that LeRobot writes (${error.message})`);
    }
    return motors.map((motor) => {
      const entry = table && Object.hasOwn(table, motor.name) ? table[motor.name] : null;
      if (!entry) throw new StoppedError(`Calibration: it has no ${motor.name}`);
      for (const [key, low, high] of [["id", 0, 253], ["range_min", 0, TURN - 2], ["range_max", entry.range_min + 1, TURN - 1]]) {
        if (Number.isInteger(entry[key]) && entry[key] >= low && entry[key] <= high) continue;
        throw new StoppedError(`Calibration: ${motor.name}.${key} is ${entry[key]}, expected a whole number from ${low} to ${high}`);
      }
      return { ...motor, id: entry.id, range: [entry.range_min, entry.range_max] };
    });
  }

  // Joint values in a straight line over the calibrated ranges, on the turn that fits the limits of the arm.
  class Scale {
    constructor(motors, ticks) {
      this.rows = motors.map(({ range: [low, high], sign, offset, lower, upper }, i) => {
        const [middle, slope] = [(low + high) / 2, sign * (TURN - 1) / TAU]; // LeRobot counts 4095 ticks to a turn
        const inside = (value) => value >= lower && value <= upper;
        const image = (value) => (inside(value) ? value : value - TAU * Math.round((value - (lower + upper) / 2) / TAU));
        const stated = -sign * rad(offset);
        const value = image(stated + (ticks[i] - middle) / slope);
        const zero = inside(value) ? value - (ticks[i] - middle) / slope : image(stated);
        return { middle, slope, zero, ends: [Math.min(low, ticks[i]), Math.max(high, ticks[i])] };
      });
      const ends = [0, 1].map((k) => this.q(motors.map(({ range }) => range[k])));
      this.limits = motors.map((_, i) => [Math.min(ends[0][i], ends[1][i]), Math.max(ends[0][i], ends[1][i])]);
    }

    q(ticks) {
      return this.rows.map(({ middle, slope, zero }, i) => zero + (ticks[i] - middle) / slope);
    }

    ticks(q) {
      return this.rows.map(({ middle, slope, zero, ends }, i) => Math.round(clamp(middle + slope * (q[i] - zero), ...ends)));
    }
  }

  // ---- What leads the arm to the page's configuration, and why it is not moved any further ----

  class Guide {
    // measured, shown: configurations of the arm and of the page; limits: of the arm itself; speed: rad/s; now: s.
    constructor(motors, measured, shown, limits, speed, now) {
      const zeros = motors.map(() => 0);
      Object.assign(this, { motors, shown, asked: measured.slice(), commanded: motors.map(() => false), before: now, followed: now });
      Object.assign(this, { moved: zeros, gap: zeros, away: zeros });
      this.speed = motors.map(({ velocity }) => Math.min(speed, velocity));
      this.limits = motors.map(({ joint, lower, upper }, i) => {
        const both = [Math.max(lower, limits[i][0]), Math.min(upper, limits[i][1])];
        if (both[0] <= both[1]) return both;
        throw new StoppedError(`${joint}: no value is inside both the limits of the page's arm and the calibrated range`);
      });
    }

    // Where the arm is to be now: each joint where it was measured, until the page moves it; then towards the page's value.
    step(measured, wanted, now) {
      const elapsed = Math.min(now - this.before, BOUNDS.LATEST);
      this.before = now;
      this.compare(measured, now);
      const began = this.commanded.some(Boolean);
      this.commanded = this.commanded.map((moves, i) => moves || Math.abs(wanted[i] - this.shown[i]) > BOUNDS.SAME);
      if (!began && this.commanded.some(Boolean)) { // the arm may have given way a little until now
        this.asked = measured.slice();
        this.gap = measured.map(() => 0);
      }
      const ways = this.asked.map((at, i) => {
        const [low, high] = this.limits[i];
        return this.commanded[i] ? clamp(wanted[i], Math.min(low, at), Math.max(high, at)) - at : 0;
      });
      const longest = Math.max(1, ...ways.map((way, i) => Math.abs(way) / (this.speed[i] * Math.max(elapsed, 1e-6))));
      this.moved = ways.map((way) => way / longest); // all joints arrive together
      this.asked = this.asked.map((at, i) => at + this.moved[i]);
      return this.asked;
    }

    compare(measured, now) {
      const gap = measured.map((value, i) => Math.abs(this.asked[i] - value));
      this.away = gap.map((value, i) => Math.max(0, this.away[i] + value - this.gap[i] - Math.abs(this.moved[i])));
      this.gap = gap;
      const most = (values) => values.indexOf(Math.max(...values));
      const [far, late] = [most(this.away), most(gap)];
      if (this.away[far] > BOUNDS.AWAY) {
        const way = `${this.motors[far].joint} has moved ${written(this.away[far])} away from where it was asked to be`;
        throw new StoppedError(`${way}: something pushes it, its motor is too weak, or its calibration is wrong`);
      }
      if (gap[late] < BOUNDS.BEHIND) this.followed = now;
      else if (now - this.followed > BOUNDS.PATIENCE) {
        const behind = `${this.motors[late].joint} is ${written(gap[late])} behind`;
        throw new StoppedError(`${behind}: something holds it, or its motor is too weak`);
      }
    }
  }

  const errors = { StoppedError, BusError };
  window.kinboardServos = { BOUNDS, Bus, Guide, Scale, calibrated, clamp, errors, goals, named, packet, rad, status, written };
})();
