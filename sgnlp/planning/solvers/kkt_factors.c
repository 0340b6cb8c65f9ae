/* Factors of Ipopt's linear systems, condensed to what couples: variables and equations.

   Ipopt solves with symmetric matrices of the variables x, of a slack s for each inequality, and of the rows:

         x   s   y_c  y_d
       [ H       C'   J' ]     H  Hessian of the Lagrangian and of the bounds' barriers
       [     S       -I  ]     S  barriers of the slacks, diagonal
       [ C      -D_c     ]     C  Jacobian of the equations
       [ J  -I      -D_d ]     J  Jacobian of the inequalities

   A slack and its row are a block [sigma e; e delta] of determinant det = sigma delta - e^2 < 0, which has one negative
   eigenvalue. Without the pair, H becomes H - (sigma / det) j j' with j the row of J. What remains, some 70 unknowns
   instead of 640, is dense: it is factored as P L B L' P' with blocks B of one or two (Bunch & Kaufman 1977). A row
   whose sigma/det would be too large beside its entries stays, and only its slack goes, for which sigma is the pivot.
   That is MA27's threshold u, by which Ipopt asks for accuracy.

   Slacks are found by their place, not by their number: unknowns that meet one other. Any symmetric matrix is solved,
   with few such pairs only more slowly.

   Ipopt loads this library as it does HSL's. So the four functions at the end have the names and arguments of HSL's
   MA27, as the user's guide of Ipopt has them. The factors lie in the arrays that Ipopt keeps between the calls. */
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { OPTIONS = 30, TOLERANCES = 5, FACTS = 20 };
enum { FLAG, WHICH, REALS = 4, INTEGERS, NEGATIVE = 14 }; /* places of the facts that are told */
enum { OUT = -1, PAIR = -2 };                             /* places of an eliminated slack, of a row gone with it */
static const int32_t SINGULAR = -5;

/* Views of Ipopt's two arrays: numbers that Ipopt keeps between factorisation and solution. */
typedef struct {
  int32_t *core;                      /* (n) place in the core, OUT or PAIR */
  int32_t *slack;                     /* (n) slack of a row, if it is out, else -1 */
  int32_t *swaps;                     /* (n) of a pivot k: its other row, or -1 - that of a block of two */
  int32_t *first, *column;            /* (n + 1), (nz) entries of the rows that are out, by place in the core */
  double *diagonal, *coupling, *work; /* (n) of the matrix; (n) e of a slack; (2 n) */
  double *entry;                      /* (nz) values at `column` */
  double *A;                          /* (c, c) lower triangle by columns: the core, then L and B */
} factors;

/* `integers` begins with the size of the core and the number of entries. */
static factors views(int32_t n, int32_t nz, int32_t *integers, double *reals) {
  factors f;
  f.core = integers + 2, f.slack = f.core + n, f.swaps = f.slack + n, f.first = f.swaps + n;
  f.column = f.first + n + 1;
  f.diagonal = reals + nz, f.coupling = f.diagonal + n, f.work = f.coupling + n, f.entry = f.work + 2 * n;
  f.A = f.entry + nz;
  return f;
}

static inline double larger(double a, double b) { return a > b ? a : b; } /* fmax is a call */

static inline double determinant(const factors *f, int32_t s, int32_t r) {
  return f->diagonal[s] * f->diagonal[r] - f->coupling[s] * f->coupling[s];
}

/* Pairs by the structure alone: partner (n) is the row of a slack, slack (n) the slack of a row, else -1. */
static void pair(int32_t n, int32_t nz, const int32_t *row, const int32_t *col, int32_t *partner, int32_t *slack,
                 int32_t *degree, int32_t *met) {
  for (int32_t i = 0; i < n; i++) degree[i] = 0, met[i] = partner[i] = slack[i] = -1;
  for (int32_t t = 0; t < nz; t++)
    if (row[t] != col[t]) {
      int32_t i = row[t] - 1, j = col[t] - 1;
      degree[i]++, degree[j]++, met[i] = j, met[j] = i;
    }
  for (int32_t s = 0; s < n; s++)
    if (degree[s] == 1 && degree[met[s]] > 1 && slack[met[s]] < 0) partner[s] = met[s], slack[met[s]] = s;
  for (int32_t t = 0; t < nz; t++) { /* of two rows that meet, one stays */
    int32_t i = row[t] - 1, j = col[t] - 1;
    if (i != j && slack[i] >= 0 && slack[j] >= 0) partner[slack[j]] = -1, slack[j] = -1;
  }
}

/* Decide what goes; returns the size of the core. `largest` (n) is the largest entry of a row beside its slack's. */
static int32_t choose(int32_t n, const int32_t *partner, const int32_t *slack, const double *largest, double u,
                      factors *f, int32_t *pairs) {
  int32_t size = 0;
  *pairs = 0;
  for (int32_t i = 0; i < n; i++) {
    f->slack[i] = -1;
    if (partner[i] < 0 && slack[i] < 0) f->core[i] = size++;
  }
  for (int32_t r = 0; r < n; r++) {
    int32_t s = slack[r];
    if (s < 0) continue;
    double sigma = f->diagonal[s], det = determinant(f, s, r);
    int known = sigma >= 0 && f->diagonal[r] <= 0 && det < 0, gone = known && u * sigma * largest[r] <= -det;
    f->core[s] = gone || (known && sigma > 0) ? OUT : size++;
    f->core[r] = gone ? PAIR : size++;
    if (f->core[s] == OUT) f->slack[r] = s;
    *pairs += gone;
  }
  return size;
}

/* Put the entries of the matrix, at `value` (nz), into the core and into the rows that are out, sorted by place. */
static void sort(int32_t n, int32_t nz, const int32_t *row, const int32_t *col, const double *value, int32_t size,
                 factors *f) {
  int32_t *end = f->swaps; /* free until the core is factored */
  memset(f->A, 0, (size_t)size * size * sizeof(double));
  for (int32_t r = 0; r < n; r++) end[r] = f->first[r];
  for (int32_t t = 0; t < nz; t++) {
    int32_t i = row[t] - 1, j = col[t] - 1, a = f->core[i], b = f->core[j];
    if (i == j || a == OUT || b == OUT) continue;
    if (a >= 0 && b >= 0) {
      f->A[a > b ? a + (size_t)b * size : b + (size_t)a * size] += value[t];
      continue;
    }
    int32_t r = a == PAIR ? i : j, place = a == PAIR ? b : a, p = end[r]++;
    for (; p > f->first[r] && f->column[p - 1] > place; p--)
      f->column[p] = f->column[p - 1], f->entry[p] = f->entry[p - 1];
    f->column[p] = place, f->entry[p] = value[t];
  }
  for (int32_t i = 0; i < n; i++) {
    int32_t s = f->slack[i];
    if (f->core[i] < 0) continue;
    f->A[f->core[i] * (size_t)(size + 1)] +=
        s < 0 ? f->diagonal[i] : f->diagonal[i] - f->coupling[s] * f->coupling[s] / f->diagonal[s];
  }
}

/* A - (sigma / det) j j' for every row that is out. Entries of a row that stand twice add up. */
static void condense(int32_t n, int32_t size, const int32_t *end, factors *f) {
  for (int32_t r = 0; r < n; r++) {
    if (f->core[r] != PAIR) continue;
    int32_t s = f->slack[r];
    double weight = f->diagonal[s] / determinant(f, s, r);
    for (int32_t p = f->first[r]; p < end[r]; p++) {
      double w = weight * f->entry[p], *restrict column = f->A + (size_t)f->column[p] * size;
      for (int32_t q = p; q < end[r]; q++) column[f->column[q]] -= w * f->entry[q];
      for (int32_t q = p - 1; q >= f->first[r] && f->column[q] == f->column[p]; q--)
        column[f->column[q]] -= w * f->entry[q];
    }
  }
}

static void swap(double *a, double *b) {
  double kept = *a;
  *a = *b, *b = kept;
}

/* Exchange rows and columns k < p of the lower triangle, and what L has of them in the columns before. */
static void exchange(double *A, int32_t c, int32_t k, int32_t p) {
  double *at_k = A + (size_t)k * c, *at_p = A + (size_t)p * c;
  for (int32_t j = 0; j < k; j++) swap(A + k + (size_t)j * c, A + p + (size_t)j * c);
  for (int32_t j = k + 1; j < p; j++) swap(at_k + j, A + p + (size_t)j * c);
  for (int32_t i = p + 1; i < c; i++) swap(at_k + i, at_p + i);
  swap(at_k + k, at_p + p);
}

/* The pivot at k by Bunch and Kaufman: its other row, with *two for a block of two; -1 if the column is zero. */
static int32_t pivot(const double *A, int32_t c, int32_t k, int *two) {
  static const double alpha = 0.6403882032022076; /* (1 + sqrt 17) / 8 bounds the growth of both kinds alike */
  const double *column = A + (size_t)k * c;
  double own = fabs(column[k]), most = 0, beside = 0;
  int32_t p = k;
  *two = 0;
  for (int32_t i = k + 1; i < c; i++)
    if (fabs(column[i]) > most) most = fabs(column[i]), p = i;
  if (!(larger(own, most) > 0)) return -1;
  if (own >= alpha * most) return k;
  for (int32_t j = k; j < p; j++) beside = larger(beside, fabs(A[p + (size_t)j * c]));
  for (int32_t i = p + 1; i < c; i++) beside = larger(beside, fabs(A[i + (size_t)p * c]));
  if (own * beside >= alpha * most * most) return k;
  *two = fabs(A[p + (size_t)p * c]) < alpha * beside;
  return p;
}

/* Column k of L, and A without it; `work` (c). Returns the number of negative eigenvalues. */
static int one(double *A, int32_t c, int32_t k, double *restrict work) {
  double *column = A + (size_t)k * c, d = column[k];
  for (int32_t i = k + 1; i < c; i++) work[i] = column[i] / d;
  for (int32_t j = k + 1; j < c; j++) {
    double w = column[j], *restrict rest = A + (size_t)j * c;
    if (w != 0)
      for (int32_t i = j; i < c; i++) rest[i] -= work[i] * w;
  }
  memcpy(column + k + 1, work + k + 1, (c - k - 1) * sizeof(double));
  return d < 0;
}

/* Columns k and k + 1 of L, and A without them; `work` (2 c). The block has eigenvalues of both signs. */
static int both(double *A, int32_t c, int32_t k, double *restrict work) {
  double *column = A + (size_t)k * c, *next = column + c, *restrict second = work + c;
  double a = column[k], b = column[k + 1], d = next[k + 1], det = a * d - b * b;
  for (int32_t i = k + 2; i < c; i++) {
    work[i] = (d * column[i] - b * next[i]) / det;
    second[i] = (a * next[i] - b * column[i]) / det;
  }
  for (int32_t j = k + 2; j < c; j++) {
    double v = column[j], w = next[j], *restrict rest = A + (size_t)j * c;
    for (int32_t i = j; i < c; i++) rest[i] -= work[i] * v + second[i] * w;
  }
  memcpy(column + k + 2, work + k + 2, (c - k - 2) * sizeof(double));
  memcpy(next + k + 2, second + k + 2, (c - k - 2) * sizeof(double));
  return 1;
}

/* Factor the core. Returns the number of negative eigenvalues, or -1 - k if pivot k is zero. */
static int32_t factor(double *A, int32_t c, int32_t *swaps, double *work) {
  int32_t negative = 0;
  for (int32_t k = 0, two; k < c; k += 1 + two) {
    int32_t p = pivot(A, c, k, &two);
    if (p < 0) return -1 - k;
    if (p != k + two) exchange(A, c, k + two, p);
    swaps[k] = two ? -1 - p : p;
    if (two) swaps[k + 1] = swaps[k];
    negative += two ? both(A, c, k, work) : one(A, c, k, work);
  }
  return negative;
}

/* x = A^-1 x with the factors of the core. */
static void solve(const double *A, int32_t c, const int32_t *swaps, double *x) {
  for (int32_t k = 0, two; k < c; k += 1 + two)
    two = swaps[k] < 0, swap(x + k + two, x + (two ? -1 - swaps[k] : swaps[k]));
  for (int32_t k = 0, two; k < c; k += 1 + two) {
    const double *l = A + (size_t)k * c, *m = l + c;
    two = swaps[k] < 0;
    if (two)
      for (int32_t i = k + 2; i < c; i++) x[i] -= l[i] * x[k] + m[i] * x[k + 1];
    else
      for (int32_t i = k + 1; i < c; i++) x[i] -= l[i] * x[k];
  }
  for (int32_t k = 0, two; k < c; k += 1 + two) {
    const double *l = A + (size_t)k * c;
    two = swaps[k] < 0;
    if (two) {
      double a = l[k], b = l[k + 1], d = l[c + k + 1], det = a * d - b * b, v = x[k], w = x[k + 1];
      x[k] = (d * v - b * w) / det, x[k + 1] = (a * w - b * v) / det;
    } else
      x[k] /= l[k];
  }
  for (int32_t k = c - 1, two; k >= 0; k -= 1 + two) { /* of a block of two, k is the second */
    two = swaps[k] < 0;
    for (int32_t j = k - two; j <= k; j++)
      for (int32_t i = k + 1; i < c; i++) x[j] -= A[i + (size_t)j * c] * x[i];
  }
  for (int32_t k = c - 1, two; k >= 0; k -= 1 + two)
    two = swaps[k] < 0, swap(x + k, x + (two ? -1 - swaps[k] : swaps[k]));
}

void ma27id_(int32_t *options, double *tolerances) {
  memset(options, 0, OPTIONS * sizeof *options);
  memset(tolerances, 0, TOLERANCES * sizeof *tolerances);
}

/* Analyse the structure. `keep` (3 n) is given to the factorisation, `spare` (2 n) is not. */
void ma27ad_(const int32_t *n, const int32_t *nz, const int32_t *row, const int32_t *col, int32_t *integers,
             const int32_t *integers_size, int32_t *keep, int32_t *spare, int32_t *steps, const int32_t *flag,
             const int32_t *options, const double *tolerances, int32_t *facts, double *operations) {
  memset(facts, 0, FACTS * sizeof *facts);
  pair(*n, *nz, row, col, keep, keep + *n, spare, spare + *n);
  *steps = *n, *operations = 0;
  facts[REALS] = 2 * *nz + 4 * *n + *n * *n;
  facts[INTEGERS] = 4 * *n + *nz + 3;
}

/* Factor the matrix with values in `reals` (nz first). `spare` (2 n). Tells the number of negative eigenvalues. */
void ma27bd_(const int32_t *n, const int32_t *nz, const int32_t *row, const int32_t *col, double *reals,
             const int32_t *reals_size, int32_t *integers, const int32_t *integers_size, const int32_t *keep,
             const int32_t *steps, int32_t *longest, int32_t *spare, const int32_t *options, const double *tolerances,
             int32_t *facts) {
  const int32_t *partner = keep, *slack = keep + *n;
  factors f = views(*n, *nz, integers, reals);
  int32_t pairs, negative;
  integers[1] = *nz;
  memset(facts, 0, FACTS * sizeof *facts);
  for (int32_t i = 0; i < *n; i++) f.diagonal[i] = f.coupling[i] = f.work[i] = f.first[i + 1] = 0;
  for (int32_t t = 0; t < *nz; t++) {
    int32_t i = row[t] - 1, j = col[t] - 1;
    double size = fabs(reals[t]);
    if (i == j) f.diagonal[i] += reals[t];
    else if (partner[i] == j) f.coupling[i] += reals[t];
    else if (partner[j] == i) f.coupling[j] += reals[t];
    else f.work[i] = larger(f.work[i], size), f.work[j] = larger(f.work[j], size), f.first[i + 1]++, f.first[j + 1]++;
  }
  f.first[0] = 0;
  integers[0] = choose(*n, partner, slack, f.work, tolerances[0], &f, &pairs);
  for (int32_t r = 0; r < *n; r++) f.first[r + 1] = f.first[r] + (f.core[r] == PAIR ? f.first[r + 1] : 0);
  sort(*n, *nz, row, col, reals, integers[0], &f);
  condense(*n, integers[0], f.swaps, &f);
  negative = factor(f.A, integers[0], f.swaps, f.work);
  *longest = *n, facts[NEGATIVE] = pairs + negative;
  if (negative < 0) facts[FLAG] = SINGULAR, facts[WHICH] = -negative;
}

/* Solve for a right-hand side (n), in place; `x` (n) is work. */
void ma27cd_(const int32_t *n, double *reals, const int32_t *reals_size, int32_t *integers,
             const int32_t *integers_size, double *x, const int32_t *longest, double *rhs, int32_t *spare,
             const int32_t *steps, const int32_t *options, const double *tolerances) {
  factors f = views(*n, integers[1], integers, reals);
  for (int32_t r = 0; r < *n; r++)
    if (f.slack[r] >= 0 && f.core[r] >= 0) rhs[r] -= f.coupling[f.slack[r]] * rhs[f.slack[r]] / f.diagonal[f.slack[r]];
  for (int32_t i = 0; i < *n; i++)
    if (f.core[i] >= 0) x[f.core[i]] = rhs[i];
  for (int32_t r = 0; r < *n; r++) {
    int32_t s = f.slack[r];
    if (f.core[r] != PAIR) continue;
    double y = (f.diagonal[s] * rhs[r] - f.coupling[s] * rhs[s]) / determinant(&f, s, r);
    for (int32_t p = f.first[r]; p < f.first[r + 1]; p++) x[f.column[p]] -= f.entry[p] * y;
  }
  solve(f.A, integers[0], f.swaps, x);
  for (int32_t i = 0; i < *n; i++)
    if (f.core[i] >= 0) rhs[i] = x[f.core[i]];
  for (int32_t r = 0; r < *n; r++) {
    int32_t s = f.slack[r];
    if (s < 0) continue;
    double sigma = f.diagonal[s], e = f.coupling[s], det = determinant(&f, s, r), b = rhs[s];
    if (f.core[r] == PAIR) {
      for (int32_t p = f.first[r]; p < f.first[r + 1]; p++) rhs[r] -= f.entry[p] * x[f.column[p]];
      rhs[s] = (f.diagonal[r] * b - e * rhs[r]) / det, rhs[r] = (sigma * rhs[r] - e * b) / det;
    } else
      rhs[s] = (b - e * rhs[r]) / sigma;
  }
}
