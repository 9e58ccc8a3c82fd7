"use strict";
// Numbers of a saved page, in the units of its reader: written, in sentences, and read where they are typed.
globalThis.kinboard = {};
(() => {
  const MINUS = "\u2212";

  // units: { degrees, length }; what is written follows `degrees` when it changes.
  kinboard.numbers = (units) => {
    const perLength = { mm: 1e3, cm: 1e2, m: 1, in: 1 / 0.0254 }[units.length];
    const decimalsOfLength = { mm: 1, cm: 2, m: 4, in: 3 }[units.length];
    const unitOf = (turns) => (turns ? (units.degrees ? "°" : "rad") : units.length);
    const scaleOf = (turns) => (turns ? (units.degrees ? 180 / Math.PI : 1) : perLength);
    const decimalsOf = (turns) => (turns ? (units.degrees ? 1 : 3) : decimalsOfLength);

    function written(value, turns) {
      const text = (value * scaleOf(turns)).toFixed(decimalsOf(turns));
      return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", MINUS);
    }

    function withUnit(value, turns) {
      const unit = unitOf(turns);
      return `${written(value, turns)}${unit === "°" ? "" : " "}${unit}`;
    }

    // As in the sentences of the full page (kin/units.py): in powers of ten where it would be written as zero.
    function sentence(value, turns) {
      const scaled = value * scaleOf(turns);
      if (scaled === 0 || Math.abs(scaled) >= 0.5 / 10 ** decimalsOf(turns)) return withUnit(value, turns);
      const [digits, exponent] = scaled.toExponential(1).split("e");
      const raised = exponent.replace("+", "").replace(/./g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign]));
      return `${digits.replace("-", MINUS)}·10${raised}${unitOf(turns) === "°" ? "" : " "}${unitOf(turns)}`;
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
      const names = turns ? ["°", "deg", "rad"] : ["mm", "cm", "m", "in"];
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
        const name = next(...names);
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

    return { read, scaleOf, decimalsOf, sentence, unitOf, withUnit, written };
  };
})();
