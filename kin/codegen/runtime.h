#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

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
static inline double arctan2(double y, double x) { return atan2(y + 0.0, x + 0.0); } // a negative zero counts as zero
static inline int64_t whole(double x) { return x >= -9223372036854775808.0 && x < 9223372036854775808.0 ? (int64_t)x : INT64_MIN; }
static inline int64_t floor_whole(double x) { return whole(floor(x)); }
static inline int64_t ceil_whole(double x) { return whole(ceil(x)); }
static inline int64_t shift_left(int64_t a, int64_t n) { return n < 64 ? (int64_t)((uint64_t)a << n) : 0; }
static inline int64_t bits_of(double x) { int64_t b; memcpy(&b, &x, sizeof b); return b; }
static inline double float_of(int64_t b) { double x; memcpy(&x, &b, sizeof x); return x; }
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
