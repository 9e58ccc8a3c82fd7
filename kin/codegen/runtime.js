const H = new Float64Array($SIZE);
let top = 0;

class A1 { constructor(o, n0) { this.o = o; this.n0 = n0; } }
class A2 { constructor(o, n0, n1) { this.o = o; this.n0 = n0; this.n1 = n1; } }
class A3 { constructor(o, n0, n1, n2) { this.o = o; this.n0 = n0; this.n1 = n1; this.n2 = n2; } }
class A4 { constructor(o, n0, n1, n2, n3) { this.o = o; this.n0 = n0; this.n1 = n1; this.n2 = n2; this.n3 = n3; } }

function alloc(n) {
  const o = top;
  if (o + n > H.length) throw new RangeError("a kernel needs more memory than was set aside: please report this");
  top += n;
  return o;
}
function filled(n, x) { const o = alloc(n); H.fill(x, o, o + n); return o; }
function filled_z(n, z) { const o = alloc(2 * n); for (let k = 0; k < n; k++) put_complex(o + 2 * k, z); return o; }
function moved(o, n) { const to = alloc(n); H.copyWithin(to, o, o + n); return to; }
function counted(a) { for (let k = 0; k < a.n0; k++) H[a.o + k] = k; return a; }
function constant(values) { const o = alloc(values.length); H.set(values, o); return o; }
function all_finite(a) { for (let k = 0; k < a.n0; k++) if (!Number.isFinite(H[a.o + k])) return false; return true; }
// Indices and slices as Python counts them: from the end where they are negative.
function at(k, n) { return k < 0 ? k + n : k; }
function clamped(k, n) { k = at(k, n); return k < 0 ? 0 : k < n ? k : n; }
function span(low, high, n) { return Math.max(clamped(high, n) - clamped(low, n), 0); }
// The first one where one is NaN.
function least(a, b) { return b < a ? b : a; }
function most(a, b) { return b > a ? b : a; }
function sin_cos(x) { return [Math.sin(x), Math.cos(x)]; }
function arctan2(y, x) { return Math.atan2(y + 0, x + 0); } // a negative zero counts as zero
function copysign(x, y) { return y < 0 || Object.is(y, -0) ? -Math.abs(x) : Math.abs(x); }
function whole(x) { return Math.abs(x) < 2 ** 63 ? Math.trunc(x) + 0 : -(2 ** 63); }
function floor_whole(x) { return whole(Math.floor(x)); }
function ceil_whole(x) { return whole(Math.ceil(x)); }
function bits(x) { if (x !== (x | 0)) throw new RangeError("a whole number beyond 32 bits"); return x; }
function times(a, b) { return exact(a * b) + 0; }
function shift_left(a, n) { return exact(a * 2 ** n); }
function shift_right(a, n) { return Math.floor(a / 2 ** n) + 0; }
function exact(x) { if (Number.isSafeInteger(x)) return x; throw new RangeError("a whole number beyond 2^53"); }
function rint(x) { // of two nearest whole numbers the even one
  const r = Math.round(x);
  return r - x === 0.5 && r % 2 !== 0 ? r - 1 : r;
}
// Towards minus infinity; by zero a whole number gives zero.
function mod_whole(a, b) { if (b === 0) return 0; const r = a % b; return (r !== 0 && r < 0 !== b < 0 ? r + b : r) + 0; }
function floordiv_whole(a, b) { return b === 0 ? 0 : Math.floor(a / b) + 0; }
function mod(a, b) { const r = a % b; return r === 0 ? copysign(0, b) : r < 0 !== b < 0 ? r + b : r; }
function floordiv(a, b) {
  const r = a % b;
  let q = (a - r) / b;
  if (r !== 0 && r < 0 !== b < 0) q -= 1;
  if (q === 0) return copysign(0, a / b);
  const f = Math.floor(q);
  return q - f > 0.5 ? f + 1 : f;
}
function power(x, n) {
  let p = 1;
  for (; n > 0; n >>= 1) {
    if (n & 1) p *= x;
    x *= x;
  }
  return p;
}

function complex_at(o) { return [H[o], H[o + 1]]; }
function put_complex(o, z) { H[o] = z[0]; H[o + 1] = z[1]; }
function cadd(a, b) { return [a[0] + b[0], a[1] + b[1]]; }
function csub(a, b) { return [a[0] - b[0], a[1] - b[1]]; }
function cmul(a, b) { return [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]; }
function cneg(a) { return [-a[0], -a[1]]; }
function cdiv(a, b) {
  if (Math.abs(b[0]) >= Math.abs(b[1])) {
    const r = b[1] / b[0], d = b[0] + b[1] * r;
    return [(a[0] + a[1] * r) / d, (a[1] - a[0] * r) / d];
  }
  const r = b[0] / b[1], d = b[0] * r + b[1];
  return [(a[0] * r + a[1]) / d, (a[1] * r - a[0]) / d];
}
function cequal(a, b) { return a[0] === b[0] && a[1] === b[1]; }
function conjugate(a) { return [a[0], -a[1]]; }
