/* Raw jets of a Gaussian-process implicit surface: mean to order 3, variance to order 2, P query points at a time, in
   two steps: what a trial point of a line search needs, then the rest if the point is accepted.

   A vector holds one number for each of P points, so that no sum runs across its lanes and a point's jet does not
   depend on its neighbours. With w = L^-1 k, v_a = L^-1 d_a k and beta = L^-T w:
     var = k(0) - w.w,   d_a var = -2 w.v_a,   d_ab var = -2 (v_a.v_b + beta.d_ab k)
   Flops of a point: values N^2 for the variance and 25 N for the mean; derivatives 4 N^2, of which 3 N^2 are
   L^-1 (d_x k, d_y k, d_z k) and N^2 beta, and 70 N. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __AVX512F__
#define P 8   /* points in a vector */
#else
#define P 4
#endif
#define ROWS 8     /* rows of L^-1 in registers, with three right-hand sides: 24 accumulators */
#define COLUMNS 12 /* rows of L^-T, with one; both divide the padded number of training points */
#define WORK 5    /* vectors of work for each training point */
#define MEAN_JET 20
#define VARIANCE_JET 10

typedef double vec __attribute__((vector_size(8 * P)));

static const double MIN_RADIUS = 1e-7;
enum { THIN_PLATE, MATERN32, MATERN52, SQUARED_EXPONENTIAL };

typedef struct {
  int64_t kernel, n;       /* n training points, padded to a multiple of 24 */
  double prior, support_radius, amplitude, prior_variance;
  const double *X, *alpha; /* (n, 3), (n) */
  const double *forward;   /* panels of ROWS rows of L^-1, each (columns up to the diagonal, ROWS) */
  const double *backward;  /* panels of COLUMNS rows of L^-T, each (columns from the diagonal on, COLUMNS) */
  double *work;            /* (5 n P), aligned, then w = L^-1 k of every vector of points with variance (.., n P) */
} surface;

static inline vec fill(double x) { return x - (vec){0}; }

/* e^x for x <= 0 to 1 ulp or so: e^x = 2^m e^f, |f| <= ln 2/2, Taylor to order 13. Vectorises, as libm's cannot. */
static inline double exponential(double x) {
  x = x < -700.0 ? -700.0 : x;
  const double shift = 6755399441055744.0; /* 1.5 2^52: rounds to an integer in the low bits */
  double y = x * 1.4426950408889634 + shift;
  int64_t m;
  memcpy(&m, &y, 8);
  double round = y - shift;
  double f = (x - round * 6.93147180369123816490e-01) - round * 1.90821492927058770002e-10;
  double s = 1.0 / 6227020800.0;
  s = s * f + 1.0 / 479001600.0;
  s = s * f + 1.0 / 39916800.0;
  s = s * f + 1.0 / 3628800.0;
  s = s * f + 1.0 / 362880.0;
  s = s * f + 1.0 / 40320.0;
  s = s * f + 1.0 / 5040.0;
  s = s * f + 1.0 / 720.0;
  s = s * f + 1.0 / 120.0;
  s = s * f + 1.0 / 24.0;
  s = s * f + 1.0 / 6.0;
  s = s * f + 0.5;
  s = s * f + 1.0;
  s = s * f + 1.0;
  int64_t bits = (m + 1023) << 52;
  double scale;
  memcpy(&scale, &bits, 8);
  return s * scale;
}

/* k, Dk, D2k, D3k at squared distances, D = (1/r) d/dr: the lines of sgnlp/surface/kernels.py. */
static inline __attribute__((always_inline)) void radial(int kernel, double R, double s0, const vec *square, vec *k,
                                                         vec *k1, vec *k2, vec *k3) {
  double s2 = s0 * s0;
  for (int l = 0; l < P; l++) {
    double r = sqrt((*square)[l]);
    r = r < MIN_RADIUS ? MIN_RADIUS : r;
    if (kernel == THIN_PLATE) {
      double inside = r < R ? 1.0 : 0.0, u = inside / r;
      (*k)[l] = inside * (R - r) * (R - r) * (R + 2 * r);
      (*k1)[l] = inside * (r - R) * 6;
      (*k2)[l] = 6 * u;
      (*k3)[l] = -6 * (u * u * u);
    } else if (kernel == MATERN32) {
      double a = 2 * sqrt(3) / R, e = s2 * exponential(-a * r), u = 1 / r;
      (*k)[l] = e * (1 + a * r);
      (*k1)[l] = -(a * a) * e;
      (*k2)[l] = a * a * a * e * u;
      (*k3)[l] = -(a * a * a) * e * (1 + a * r) * (u * u * u);
    } else if (kernel == MATERN52) {
      double a = 2 * sqrt(5) / R, e = s2 * exponential(-a * r), t = a * r;
      (*k)[l] = e * (1 + t + t * t / 3);
      (*k1)[l] = -(a * a / 3) * e * (1 + t);
      (*k2)[l] = a * a * a * a / 3 * e;
      (*k3)[l] = -(a * a * a * a * a / 3) * e / r;
    } else {
      double b = 16 / (R * R), e = s2 * exponential(-b * r * r / 2);
      (*k)[l] = e;
      (*k1)[l] = -b * e;
      (*k2)[l] = b * b * e;
      (*k3)[l] = -(b * b * b) * e;
    }
  }
}

/* One vector of points z: value and first derivatives of the mean into J (4), and the kernel into k (n). */
static inline __attribute__((always_inline)) void mean_values(const surface *s, int kernel, const vec *z, vec *J,
                                                              vec *kernels) {
  vec value = {0}, g[3] = {{0}};
  for (int64_t n = 0; n < s->n; n++) {
    const double *x = s->X + 3 * n;
    vec d0 = z[0] - x[0], d1 = z[1] - x[1], d2 = z[2] - x[2];
    vec square = d0 * d0 + d1 * d1 + d2 * d2, k, k1, k2, k3;
    radial(kernel, s->support_radius, s->amplitude, &square, &k, &k1, &k2, &k3);
    if (kernels) kernels[n] = k;
    vec w1 = k1 * s->alpha[n];
    value += k * s->alpha[n];
    g[0] += w1 * d0, g[1] += w1 * d1, g[2] += w1 * d2;
  }
  J[0] = value + s->prior;
  for (int a = 0; a < 3; a++) J[1 + a] = g[a];
}

/* w = L^-1 k (n) of one vector of points, and its square, by which the variance is below the prior's. */
static vec whiten(const surface *s, const vec *kernels, vec *w) {
  vec sum = {0};
  const double *A = s->forward;
  for (int64_t i = 0; i < s->n; i += ROWS) {
    vec t[ROWS] = {{0}};
    for (int64_t j = 0; j < i + ROWS; j++, A += ROWS) {
      vec k = kernels[j];
#pragma GCC unroll 8
      for (int row = 0; row < ROWS; row++) t[row] += k * A[row];
    }
#pragma GCC unroll 8
    for (int row = 0; row < ROWS; row++) w[i + row] = t[row], sum += t[row] * t[row];
  }
  return sum;
}

/* One vector of points z: derivatives of order 2 and 3 of the mean into J (16), and what those of the variance need:
   right-hand sides d_a k (n, 3), and Dk and D2k (n, 2). */
static inline __attribute__((always_inline)) void mean_derivatives(const surface *s, int kernel, const vec *z, vec *J,
                                                                   vec *sides, vec *curved) {
  vec slope = {0}, first[3] = {{0}}, second[6] = {{0}}, third[10] = {{0}};
  for (int64_t n = 0; n < s->n; n++) {
    const double *x = s->X + 3 * n;
    double alpha = s->alpha[n];
    vec d0 = z[0] - x[0], d1 = z[1] - x[1], d2 = z[2] - x[2];
    vec d00 = d0 * d0, d11 = d1 * d1, d22 = d2 * d2, d01 = d0 * d1, d02 = d0 * d2, d12 = d1 * d2;
    vec square = d00 + d11 + d22, k, k1, k2, k3;
    radial(kernel, s->support_radius, s->amplitude, &square, &k, &k1, &k2, &k3);
    if (sides) {
      sides[3 * n] = k1 * d0, sides[3 * n + 1] = k1 * d1, sides[3 * n + 2] = k1 * d2;
      curved[2 * n] = k1, curved[2 * n + 1] = k2;
    }
    vec w2 = k2 * alpha, w3 = k3 * alpha;
    slope += k1 * alpha;
    first[0] += w2 * d0, first[1] += w2 * d1, first[2] += w2 * d2;
    second[0] += w2 * d00, second[1] += w2 * d01, second[2] += w2 * d02;
    second[3] += w2 * d11, second[4] += w2 * d12, second[5] += w2 * d22;
    vec t0 = w3 * d0, t1 = w3 * d1, t2 = w3 * d2;
    third[0] += t0 * d00, third[1] += t0 * d01, third[2] += t0 * d02, third[3] += t0 * d11, third[4] += t0 * d12;
    third[5] += t0 * d22, third[6] += t1 * d11, third[7] += t1 * d12, third[8] += t1 * d22, third[9] += t2 * d22;
  }
  J[0] = second[0] + slope, J[1] = second[1], J[2] = second[2];
  J[3] = second[3] + slope, J[4] = second[4], J[5] = second[5] + slope;
  J[6] = third[0] + 3 * first[0], J[7] = third[1] + first[1], J[8] = third[2] + first[2];
  J[9] = third[3] + first[0], J[10] = third[4], J[11] = third[5] + first[0];
  J[12] = third[6] + 3 * first[1], J[13] = third[7] + first[2], J[14] = third[8] + first[1];
  J[15] = third[9] + 3 * first[2];
}

/* Derivatives V (9) of the variance of one vector of points z whose w = L^-1 k is known. */
static void variance_derivatives(const surface *s, const vec *z, const vec *sides, const vec *curved, const vec *w,
                                 vec *V) {
  vec sum[9] = {{0}}; /* w.v_a, v_a.v_b + beta.d_ab k */
  const double *A = s->forward;
  for (int64_t i = 0; i < s->n; i += ROWS) {
    vec t[ROWS][3] = {{{0}}};
    for (int64_t j = 0; j < i + ROWS; j++, A += ROWS) {
      vec r0 = sides[3 * j], r1 = sides[3 * j + 1], r2 = sides[3 * j + 2];
#pragma GCC unroll 8
      for (int row = 0; row < ROWS; row++) {
        vec a = fill(A[row]);
        t[row][0] += a * r0, t[row][1] += a * r1, t[row][2] += a * r2;
      }
    }
#pragma GCC unroll 8
    for (int row = 0; row < ROWS; row++) {
      vec a = t[row][0], b = t[row][1], c = t[row][2];
      sum[0] += w[i + row] * a, sum[1] += w[i + row] * b, sum[2] += w[i + row] * c;
      sum[3] += a * a, sum[4] += a * b, sum[5] += a * c, sum[6] += b * b, sum[7] += b * c, sum[8] += c * c;
    }
  }
  const double *B = s->backward;
  for (int64_t i = 0; i < s->n; i += COLUMNS) {
    vec beta[COLUMNS] = {{0}};
    for (int64_t j = i; j < s->n; j++, B += COLUMNS) {
#pragma GCC unroll 12
      for (int row = 0; row < COLUMNS; row++) beta[row] += w[j] * B[row];
    }
#pragma GCC unroll 12
    for (int row = 0; row < COLUMNS; row++) {
      const double *x = s->X + 3 * (i + row);
      vec d0 = z[0] - x[0], d1 = z[1] - x[1], d2 = z[2] - x[2];
      vec slope = beta[row] * curved[2 * (i + row)], q = beta[row] * curved[2 * (i + row) + 1];
      vec q0 = q * d0, q1 = q * d1;
      sum[3] += q0 * d0 + slope, sum[4] += q0 * d1, sum[5] += q0 * d2;
      sum[6] += q1 * d1 + slope, sum[7] += q1 * d2, sum[8] += q * d2 * d2 + slope;
    }
  }
  for (int i = 0; i < 9; i++) V[i] = -2 * sum[i];
}

/* Points q to q + P - 1 of Z (Q, 3), stored by columns; the last one again beyond the end. */
static inline void gather(const double *Z, int64_t stride, int64_t Q, int64_t q, vec *z) {
  for (int l = 0; l < P; l++)
    for (int a = 0; a < 3; a++) z[a][l] = Z[(q + l < Q ? q + l : Q - 1) + stride * a];
}

/* The first `count` numbers of each lane to `to` (Q, width), from point q on. */
static inline void scatter(const vec *from, int count, double *to, int64_t width, int64_t Q, int64_t q) {
  for (int l = 0; l < P && q + l < Q; l++)
    for (int i = 0; i < count; i++) to[(q + l) * width + i] = from[i][l];
}

static inline __attribute__((always_inline)) void values(const surface *s, int kernel, int64_t Q, int64_t uncertain,
                                                         const double *Z, int64_t stride, double *J, double *V) {
  vec *kernels = (vec *)s->work, *white = kernels + WORK * s->n, z[3], mean[4];
  for (int64_t q = 0; q < Q; q += P) {
    gather(Z, stride, Q, q, z);
    mean_values(s, kernel, z, mean, q < uncertain ? kernels : 0);
    scatter(mean, 4, J, MEAN_JET, Q, q);
    if (q >= uncertain) continue;
    vec variance = s->prior_variance - whiten(s, kernels, white + q / P * s->n);
    scatter(&variance, 1, V, VARIANCE_JET, uncertain, q);
  }
}

static inline __attribute__((always_inline)) void derivatives(const surface *s, int kernel, int64_t Q,
                                                              int64_t uncertain, const double *Z, int64_t stride,
                                                              double *J, double *V) {
  vec *sides = (vec *)s->work, *curved = sides + 3 * s->n, *white = sides + WORK * s->n;
  vec z[3], mean[MEAN_JET - 4], variance[VARIANCE_JET - 1];
  for (int64_t q = 0; q < Q; q += P) {
    gather(Z, stride, Q, q, z);
    mean_derivatives(s, kernel, z, mean, q < uncertain ? sides : 0, curved);
    scatter(mean, MEAN_JET - 4, J + 4, MEAN_JET, Q, q);
    if (q >= uncertain) continue;
    variance_derivatives(s, z, sides, curved, white + q / P * s->n, variance);
    scatter(variance, VARIANCE_JET - 1, V + 1, VARIANCE_JET, uncertain, q);
  }
}

#define FOR_EVERY_KERNEL(step)                                                                                    \
  switch (s->kernel) {                                                                                            \
    case THIN_PLATE: step(s, THIN_PLATE, Q, uncertain, Z, stride, J, V); break;                                   \
    case MATERN32: step(s, MATERN32, Q, uncertain, Z, stride, J, V); break;                                       \
    case MATERN52: step(s, MATERN52, Q, uncertain, Z, stride, J, V); break;                                       \
    default: step(s, SQUARED_EXPONENTIAL, Q, uncertain, Z, stride, J, V);                                         \
  }

/* Value and first derivatives of the mean at the points Z (Q, 3), stored by columns `stride` apart, into J[:, :4] of
   J (Q, 20), and the variance at the first `uncertain` of them into V[:, 0] of V (uncertain, 10). */
void gpis_values(const surface *s, int64_t Q, int64_t uncertain, const double *Z, int64_t stride, double *J,
                 double *V) {
  FOR_EVERY_KERNEL(values)
}

/* The rest of J and V. The points whose variance is asked for are those of the last call of gpis_values that asked for
   any. */
void gpis_derivatives(const surface *s, int64_t Q, int64_t uncertain, const double *Z, int64_t stride, double *J,
                      double *V) {
  FOR_EVERY_KERNEL(derivatives)
}
