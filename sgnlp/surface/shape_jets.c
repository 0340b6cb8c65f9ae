/* Jets of the smooth distance to the nearest of several shapes: `ShapeField.jets` of sgnlp/surface/shape_field.py, which
   has the equations. A point's jet does not depend on its neighbours. */
#include <float.h>
#include <math.h>
#include <stdint.h>

#define JET 10

typedef struct {
  double centre[3], rotation[9], half[3], radius; /* rotation by rows: its columns are the shape's axes */
  double circular;                                /* whether x and y are one radial coordinate */
} shape;

typedef struct {
  int64_t count;
  double width, mixing, negligible; /* w, tau [m], and what a shape is farther than the nearest to have no part [m] */
  const shape *shapes;
  double *work; /* (count), the exact distances of a point */
} field;

/* x in the frame of a shape. */
static inline void local(const shape *s, const double *x, double *u) {
  double d0 = x[0] - s->centre[0], d1 = x[1] - s->centre[1], d2 = x[2] - s->centre[2];
  for (int i = 0; i < 3; i++) u[i] = d0 * s->rotation[i] + d1 * s->rotation[3 + i] + d2 * s->rotation[6 + i];
}

static inline double greater(double a, double b) { return a > b ? a : b; }

static double exact(const shape *s, const double *x) {
  double u[3], q[3], outside = 0;
  local(s, x, u);
  for (int i = 0; i < 3; i++) q[i] = fabs(u[i]) - s->half[i];
  if (s->circular != 0) q[0] = sqrt(u[0] * u[0] + u[1] * u[1]) - s->half[0], q[1] = q[2];
  double top = greater(greater(q[0], q[1]), q[2]);
  if (top <= 0) return top - s->radius;
  if (s->circular != 0) q[1] = 0;
  for (int i = 0; i < 3; i++) outside += greater(q[i], 0) * greater(q[i], 0);
  return sqrt(outside) - s->radius;
}

/* p(q) = (q + sqrt(q^2 + w^2))/2 without cancellation, and its two derivatives. */
static inline double positive(double q, double w, double *first, double *second) {
  double root = sqrt(q * q + w * w);
  *first = (1 + q / root) / 2;
  *second = w * w / (2 * root * root * root);
  return q > 0 ? (q + root) / 2 : w * w / (2 * (root - q));
}

/* q of a point in the frame of a shape; dq/du into F and, if that is circular, d2q_0/du2 of x, y into B, else the
   diagonal d2q_i/du_i2 into B. */
typedef struct {
  double q[3], F[3][3], B[3][3][3];
} coordinates;

static void coordinate(const shape *s, const double *u, double w, coordinates *c) {
  *c = (coordinates){0};
  for (int i = 0; i < 3; i++) {
    double root = sqrt(u[i] * u[i] + w * w);
    c->q[i] = root - s->half[i];
    c->F[i][i] = u[i] / root;
    c->B[i][i][i] = w * w / (root * root * root);
  }
  if (s->circular == 0) return;
  double radial = sqrt(u[0] * u[0] + u[1] * u[1] + w * w), slope[2] = {u[0] / radial, u[1] / radial};
  c->q[0] = radial - s->half[0], c->q[1] = -s->half[1];
  c->F[1][1] = c->B[1][1][1] = 0;
  for (int a = 0; a < 2; a++) {
    c->F[0][a] = slope[a];
    for (int b = 0; b < 2; b++) c->B[0][a][b] = ((a == b) - slope[a] * slope[b]) / radial;
  }
}

/* s_j of coordinates q and, if asked for, its derivatives by them. */
static double rounded(const field *f, const double *q, double *by_q, double (*by_qq)[3]) {
  double p[3], p1[3], p2[3], share[3], w = f->width, square = w * w, total = 0, d1, d2;
  double top = greater(greater(q[0], q[1]), q[2]);
  for (int i = 0; i < 3; i++) {
    p[i] = positive(q[i], w, p1 + i, p2 + i);
    square += p[i] * p[i];
    share[i] = exp((q[i] - top) / f->mixing);
    total += share[i];
  }
  double root = sqrt(square), depth = positive(-top - f->mixing * log(total), w, &d1, &d2);
  if (!by_q) return root - depth;
  double outer[3];
  for (int i = 0; i < 3; i++) {
    share[i] /= total;
    outer[i] = p[i] / root * p1[i];
    by_q[i] = outer[i] + d1 * share[i];
  }
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++)
      by_qq[i][k] = -outer[i] * outer[k] / root - (d1 / f->mixing + d2) * share[i] * share[k];
    by_qq[i][i] += (p1[i] * p1[i] + p[i] * p2[i]) / root + d1 / f->mixing * share[i];
  }
  return root - depth;
}

/* A^T M A for M symmetric, if turned; else A M A^T. */
static void congruent(double (*A)[3], double (*M)[3], int turned, double (*result)[3]) {
  double half[3][3];
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) {
      half[i][k] = 0;
      for (int l = 0; l < 3; l++) half[i][k] += (turned ? A[l][i] : A[i][l]) * M[l][k];
    }
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) {
      result[i][k] = 0;
      for (int l = 0; l < 3; l++) result[i][k] += half[i][l] * (turned ? A[l][k] : A[k][l]);
    }
}

/* s_j at x, and if asked for its gradient g and Hessian H in the world. */
static double smooth(const field *f, const shape *s, const double *x, double *g, double (*H)[3]) {
  double u[3], by_q[3], by_qq[3][3], inner[3][3], R[3][3];
  coordinates c;
  local(s, x, u);
  coordinate(s, u, f->width, &c);
  double value = rounded(f, c.q, g ? by_q : 0, by_qq) - s->radius;
  if (!g) return value;
  congruent(c.F, by_qq, 1, inner);
  for (int a = 0; a < 3; a++)
    for (int b = 0; b < 3; b++) {
      R[a][b] = s->rotation[3 * a + b];
      for (int i = 0; i < 3; i++) inner[a][b] += by_q[i] * c.B[i][a][b];
    }
  congruent(R, inner, 0, H);
  for (int a = 0; a < 3; a++) {
    g[a] = 0;
    for (int b = 0; b < 3; b++)
      for (int i = 0; i < 3; i++) g[a] += R[a][b] * c.F[i][b] * by_q[i];
  }
  return value;
}

/* The jet of one point x; without its derivatives unless `complete`. */
static void jet(const field *f, const double *x, int complete, double *result) {
  double least = DBL_MAX, total = 0, mean[3] = {0}, bent[3][3] = {{0}}, g[3], H[3][3];
  for (int64_t j = 0; j < f->count; j++) {
    f->work[j] = exact(f->shapes + j, x);
    least = f->work[j] < least ? f->work[j] : least;
  }
  for (int64_t j = 0; j < f->count; j++) {
    if (f->work[j] > least + f->negligible) continue;
    double value = smooth(f, f->shapes + j, x, complete ? g : 0, H), share = exp(-(value - least) / f->mixing);
    total += share;
    for (int a = 0; complete && a < 3; a++) {
      mean[a] += share * g[a];
      for (int b = 0; b < 3; b++) bent[a][b] += share * (H[a][b] - g[a] * g[b] / f->mixing);
    }
  }
  result[0] = least - f->mixing * log(total);
  for (int a = 0; a < 3; a++) result[1 + a] = mean[a] /= total;
  for (int i = 4, a = 0; a < 3; a++)
    for (int b = a; b < 3; b++) result[i++] = bent[a][b] / total + mean[a] * mean[b] / f->mixing;
}

/* Jets (K, 10) of a field that is not empty at points (K, 3), both stored by columns, `stride` and `pitch` apart. Without
   `complete` the derivatives are 0. */
void shape_jets(const field *f, int64_t K, const double *points, int64_t stride, int64_t complete, double *jets,
                int64_t pitch) {
  for (int64_t k = 0; k < K; k++) {
    double x[3] = {points[k], points[k + stride], points[k + 2 * stride]}, result[JET];
    jet(f, x, complete != 0, result);
    for (int i = 0; i < JET; i++) jets[k + i * pitch] = result[i];
  }
}
