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

    // What is typed, as kin/typed.py reads it in the full page: an expression such as pi/4, 2*45 or 90deg in the unit on
    // screen; pi is in radians whatever the unit.
    const PER = { "°": 180 / Math.PI, deg: 180 / Math.PI, rad: 1, mm: 1e3, cm: 1e2, m: 1, in: 1 / 0.0254 };
    const TOKEN = /\s*(?:((?:\d+(?:_\d+)*\.?(?:\d+(?:_\d+)*)?|\.\d+(?:_\d+)*)(?:e[+-]?\d+)?)|(°|π|[a-z]+|\*\*|[-+*/^()]))/y;
    const SIGNS = { "−–‐‑‒﹣": "-", "×·⋅∙∗": "*", "÷∕⁄": "/", "º˚": "°", "\u200b\u2060\ufeff": "", "٫": "." };
    const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    const SPACED = /(?<=[0-9])[\u2009\u202f](?=[0-9]{3}(?![0-9]))/g;
    // 1,000; and 1.234,5 or 1.234.567.
    const THOUSANDS = /(?<![0-9.,])[1-9][0-9]{0,2}(?:,[0-9]{3})+(?![0-9,])/g;
    const POINTS = /(?<![0-9.,])[1-9][0-9]{0,2}(?:(?:\.[0-9]{3})+,[0-9]+|(?:\.[0-9]{3}){2,})(?![0-9.,])/g;
    const LONGEST = 100; // characters
    const DEEPEST = 20; // brackets within each other

    function plain(letter) {
      for (const [letters, sign] of Object.entries(SIGNS)) if (letters.includes(letter)) return sign;
      const code = letter.codePointAt(0);
      if (code >= 0xff01 && code <= 0xff5e) return String.fromCodePoint(code - 0xfee0); // full width
      if (!/\p{Nd}/u.test(letter)) return letter;
      let before = 0; // digits of a script stand in a row, the zero first
      while (/\p{Nd}/u.test(String.fromCodePoint(code - before - 1))) before += 1;
      return String(before % 10);
    }

    function clean(text) {
      const low = (raised) => `^${[...raised].map((each) => ({ "⁺": "+", "⁻": "-" })[each] ?? RAISED.indexOf(each)).join("")}`;
      return [...text.replace(SPACED, "").replace(/[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+/g, low)].map(plain).join("").toLowerCase().trim();
    }

    function tokensOf(text) {
      const found = [];
      TOKEN.lastIndex = 0;
      while (TOKEN.lastIndex < text.length) {
        const part = TOKEN.exec(text);
        if (!part) return [];
        found.push(part[1] ? Number(part[1].replaceAll("_", "")) : part[2]);
      }
      return found;
    }

    // A value is [number, state, alone]: bare, in the unit on screen once it meets one that is not; in radians because of
    // pi; or measured, where `alone` are a number and the unit that directly follows it.
    const [BARE, OF_PI, MEASURED] = [0, 1, 2];

    // The value of a cleaned text without commas, or null.
    function valueOf(text, turns) {
      const tokens = tokensOf(text);
      const names = turns ? ["°", "deg", "rad"] : ["mm", "cm", "m", "in"];
      const measured = ([value, state]) => (state ? value : value / scaleOf(turns));
      const next = (...wanted) => (wanted.includes(tokens[0]) ? tokens.shift() : null);
      const fail = () => { throw new SyntaxError("no number"); };
      const combined = (a, mark, b) => (mark === "*" ? a * b : a / b);
      let depth = 0;

      function atom() {
        if (next("(")) {
          depth += 1;
          if (depth > DEEPEST) fail();
          const [value, state] = sum();
          depth -= 1;
          return next(")") ? [value, state] : fail();
        }
        const number = typeof tokens[0] === "number" ? tokens.shift() : null;
        if (next("pi", "π")) return [(number ?? 1) * Math.PI, turns ? OF_PI : BARE];
        return number === null ? fail() : [number, BARE];
      }
      function power() {
        const [value, state] = atom();
        if (!next("^", "**")) return [value, state];
        const sign = next("+", "-") === "-" ? -1 : 1;
        const exponent = tokens.shift();
        return state || typeof exponent !== "number" ? fail() : [value ** (sign * exponent), BARE];
      }
      function signed() {
        let sign = 1;
        for (let mark = next("+", "-"); mark; mark = next("+", "-")) if (mark === "-") sign = -sign;
        const [value, state] = power();
        const name = next(...names);
        if (!name) return [sign * value, state];
        if (state === MEASURED || (state === OF_PI && name !== "rad")) fail();
        return [(sign * value) / PER[name], MEASURED, [sign * value, name]];
      }
      function product() {
        let [value, state] = signed();
        for (let mark = next("*", "/"); mark; mark = next("*", "/")) {
          const [other, has, alone] = signed();
          if (alone && (state === BARE || (state === OF_PI && alone[1] === "rad"))) {
            value = combined(value, mark, alone[0]) / PER[alone[1]];
          } else if (has && (state || mark === "/")) {
            fail();
          } else {
            value = combined(value, mark, other);
          }
          state = Math.max(state, has);
        }
        return [value, state];
      }
      function sum() {
        let [value, state] = product();
        for (let mark = next("+", "-"); mark; mark = next("+", "-")) {
          const [other, has] = product();
          const both = Boolean(state || has);
          const added = both ? measured([other, has]) : other;
          value = (both ? measured([value, state]) : value) + (mark === "+" ? added : -added);
          state = Math.max(state, has);
        }
        return [value, state];
      }
      try {
        const value = measured(sum());
        return tokens.length || !Number.isFinite(value) ? null : value + 0; // no −0
      } catch (error) {
        if (error instanceof SyntaxError) return null;
        throw error;
      }
    }

    // A typed number in radians or metres, or null; also where a comma may separate thousands as well as decimals and both
    // are between the limits of the field.
    function read(text, turns, [low, high] = [-Infinity, Infinity]) {
      if (text.length > LONGEST) return null;
      const cleaned = clean(text);
      const most = turns ? 1000 * Math.PI / 180 : 1000; // what is no reading of a comma: 1,250 m is 1.25 m
      const decimal = valueOf(cleaned.replaceAll(",", "."), turns);
      for (const [pattern, mark] of [[THOUSANDS, ","], [POINTS, "."]]) {
        const grouped = cleaned.replace(pattern, (found) => found.replaceAll(mark, ""));
        const value = grouped === cleaned ? null : valueOf(grouped.replaceAll(",", "."), turns);
        if (value !== null && (decimal === null || (value >= low && value <= high && Math.abs(value) < most))) return null;
      }
      return decimal;
    }

    return { read, scaleOf, decimalsOf, sentence, unitOf, withUnit, written };
  };
})();
