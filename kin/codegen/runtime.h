#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#if defined(__SSE2__) && defined(__x86_64__)
#include <emmintrin.h>
#endif

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "rows that do not exist are NaN: compile without -ffast-math and -ffinite-math-only"
#endif
#if DBL_MANT_DIG < 53
#error "double must have 64 bits"
#endif
#ifdef __cplusplus
#define KINBOARD_ZERO {}
#else
#define KINBOARD_ZERO {0}
#endif
#if defined(__GNUC__) && !defined(__OPTIMIZE_SIZE__) // loops over calls that are inlined are vectorised
#define KINBOARD_INLINE static inline __attribute__((always_inline))
#else
#define KINBOARD_INLINE static inline
#endif

typedef struct { double re, im; } cplx;
static inline double *filled_f(double *p, int64_t n, double x) { for (int64_t k = 0; k < n; k++) p[k] = x; return p; }
static inline int64_t *filled_i(int64_t *p, int64_t n, int64_t x) { for (int64_t k = 0; k < n; k++) p[k] = x; return p; }
static inline bool *filled_b(bool *p, int64_t n, bool x) { for (int64_t k = 0; k < n; k++) p[k] = x; return p; }
static inline cplx *filled_z(cplx *p, int64_t n, cplx x) { for (int64_t k = 0; k < n; k++) p[k] = x; return p; }
static inline void *copied(void *to, const void *from, size_t size) { return memcpy(to, from, size); }
// Indices and slices as Python counts them: from the end where they are negative.
static inline int64_t at(int64_t k, int64_t n) { return k < 0 ? k + n : k; }
static inline int64_t clamped(int64_t k, int64_t n) { k = at(k, n); return k < 0 ? 0 : k < n ? k : n; }
static inline int64_t span(int64_t low, int64_t high, int64_t n) { int64_t k = clamped(high, n) - clamped(low, n); return k < 0 ? 0 : k; }
// The first one where one is NaN.
static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }
static inline int64_t least_whole(int64_t a, int64_t b) { return b < a ? b : a; }
static inline int64_t most_whole(int64_t a, int64_t b) { return b > a ? b : a; }
static inline int64_t abs_whole(int64_t a) { return a < 0 ? -a : a; }
#if defined(__SSE2__) && defined(__x86_64__) // one instruction: INT64_MIN for what does not fit
static inline int64_t whole(double x) { return _mm_cvttsd_si64(_mm_set_sd(x)); }
#else
static inline int64_t whole(double x) { return fabs(x) < 9223372036854775808.0 ? (int64_t)x : INT64_MIN; }
#endif
static inline int64_t floor_whole(double x) { return whole(floor(x)); }
static inline int64_t ceil_whole(double x) { return whole(ceil(x)); }
static inline int64_t shift_left(int64_t a, int64_t n) { return n < 64 ? (int64_t)((uint64_t)a << n) : 0; }
static inline int64_t bits_of(double x) { int64_t b; memcpy(&b, &x, sizeof b); return b; }
static inline double float_of(int64_t b) { double x; memcpy(&x, &b, sizeof x); return x; }
// Sine, cosine and arc tangent as kin.kernels.simd has them: no jumps, a dozen multiplications, at most 2.4 ulp off.
// FP_FAST_FMA is not in clang. Of Arm, bit 3 of __ARM_FP is double precision: a Cortex-M4 fuses floats alone.
#if defined(FP_FAST_FMA) || defined(__FMA__) || (defined(__ARM_FEATURE_FMA) && (__ARM_FP & 8))
KINBOARD_INLINE double fused(double a, double b, double c) { return fma(a, b, c); }
#else
KINBOARD_INLINE double fused(double a, double b, double c) { return a * b + c; }
#endif
#if FLT_EVAL_METHOD != 0 || defined(__ASSOCIATIVE_MATH__) // sums are not rounded one by one, which `shifted` needs
static inline void sine_cosine_to(double x, double *sine, double *cosine) { *sine = sin(x); *cosine = cos(x); }
#else
KINBOARD_INLINE void sine_cosine_to(double x, double *sine, double *cosine) {
  double shifted = x * 0.6366197723675814 + 6755399441055744.0, k = shifted - 6755399441055744.0;
  int64_t quadrant = bits_of(shifted);
  double r = fused(-k, 2.0222662487959506e-21, fused(-k, 6.077100506303966e-11, fused(-k, 1.5707963267341256, x)));
  double z = r * r;
  double p = fused(z, fused(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08), 2.75573137070700676789e-06);
  p = fused(z, fused(z, p, -1.98412698298579493134e-04), 8.33333333332248946124e-03);
  double odd = fused(z * r, fused(z, p, -1.66666666666666324348e-01), r);
  p = fused(z, fused(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09), -2.75573143513906633035e-07);
  p = fused(z, fused(z, p, 2.48015872894767294178e-05), -1.38888888888741095749e-03);
  p = fused(z, p, 4.16666666666666019037e-02);
  double half = 0.5 * z, w = 1.0 - half, even = w + fused(z * z, p, (1.0 - w) - half);
  bool turned = (quadrant & 1) != 0;
  double s = turned ? even : odd, c = turned ? odd : even;
  *sine = float_of(bits_of(s) ^ (int64_t)(((uint64_t)quadrant & 2) << 62));
  *cosine = float_of(bits_of(c) ^ (int64_t)((((uint64_t)quadrant + 1) & 2) << 62));
}
#endif
KINBOARD_INLINE double arctan2(double y, double x) { // a negative zero counts as zero
  double across = fabs(y), along = fabs(x);
  bool steep = across > along;
  double low = steep ? along : across, high = steep ? across : along;
  bool fold = low > 0.41421356237309503 * high;
  double above = fold ? low - high : low, below = fold ? low + high : high;
  double t = above / (below == 0.0 ? 1.0 : below), z = t * t, w = z * z;
  double even = fused(w, -0.019169476385361265, -0.05085240174154878);
  even = fused(w, fused(w, even, -0.06664506835133263), -0.09090904564022367);
  even = fused(w, fused(w, even, -0.14285714284662226), -0.3333333333333333);
  double odd = fused(w, 0.03922560559586107, 0.05858108856106755);
  odd = fused(w, fused(w, fused(w, odd, 0.07692182863309693), 0.11111111014909221), 0.199999999999955);
  double rest = t + (fold ? 3.061616997868383e-17 : 0.0);
  double angle = fused(t * z, fused(z, odd, even), rest) + (fold ? 0.7853981633974483 : 0.0);
  double turned = 1.5707963267948966 - (angle - 6.123233995736766e-17);
  angle = steep ? turned : angle;
  turned = 3.141592653589793 - (angle - 2.0 * 6.123233995736766e-17);
  angle = x < 0.0 ? turned : angle;
  return y < 0.0 ? -angle : angle;
}
// Towards minus infinity; by zero it is zero.
static inline int64_t mod_whole(int64_t a, int64_t b) {
  if (b == 0 || b == -1) return 0;
  int64_t r = a % b;
  return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}
static inline int64_t floordiv_whole(int64_t a, int64_t b) {
  if (b == 0) return 0;
  if (b == -1) return -a;
  return a / b - (a % b != 0 && (a < 0) != (b < 0));
}
static inline double mod(double a, double b) {
  double r = fmod(a, b);
  if (r == 0.0) return copysign(0.0, b);
  return (r < 0.0) != (b < 0.0) ? r + b : r;
}
static inline double floordiv(double a, double b) {
  double r = fmod(a, b), q = (a - r) / b;
  if (r != 0.0 && (r < 0.0) != (b < 0.0)) q -= 1.0;
  if (q == 0.0) return copysign(0.0, a / b);
  double f = floor(q);
  return q - f > 0.5 ? f + 1.0 : f;
}
static inline double power(double x, int64_t n) {
  double p = 1.0;
  for (; n > 0; n >>= 1) {
    if ((n & 1) != 0) p *= x;
    x *= x;
  }
  return p;
}

static inline cplx cplx_of(double re, double im) { cplx z; z.re = re; z.im = im; return z; }
static inline cplx cadd(cplx a, cplx b) { return cplx_of(a.re + b.re, a.im + b.im); }
static inline cplx csub(cplx a, cplx b) { return cplx_of(a.re - b.re, a.im - b.im); }
static inline cplx cmul(cplx a, cplx b) { return cplx_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re); }
static inline cplx cneg(cplx a) { return cplx_of(-a.re, -a.im); }
static inline cplx cdiv(cplx a, cplx b) {
  if (fabs(b.re) >= fabs(b.im)) {
    double r = b.im / b.re, d = b.re + b.im * r;
    return cplx_of((a.re + a.im * r) / d, (a.im - a.re * r) / d);
  }
  double r = b.re / b.im, d = b.re * r + b.im;
  return cplx_of((a.re * r + a.im) / d, (a.im * r - a.re) / d);
}
static inline bool cequal(cplx a, cplx b) { return a.re == b.re && a.im == b.im; }
static inline cplx conjugate(cplx a) { return cplx_of(a.re, -a.im); }
