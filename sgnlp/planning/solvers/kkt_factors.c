/* Factors of Ipopt's linear systems, condensed to what couples: variables and equations.

   Ipopt solves with symmetric matrices of the variables x, of a slack s for each inequality, and of the rows:

         x   s   y_c  y_d
       [ H       C'   J' ]     H  Hessian of the Lagrangian and of the bounds' barriers
       [     S       -I  ]     S  barriers of the slacks, diagonal
       [ C      -D_c     ]     C  Jacobian of the equations
       [ J  -I      -D_d ]     J  Jacobian of the inequalities

   A slack and its row are a block [sigma e; e delta] of determinant det = sigma delta - e^2 < 0, which has one negative
   eigenvalue. Without the pair, H becomes H - (sigma / det) j j' with j the row of J. What remains, some 70 unknowns
   instead of 640, is dense; `dense_ldl.c` factors it. A row whose sigma / det would be too large beside its entries
   stays, and only its slack goes, for which sigma is the pivot. That is MA27's threshold u, by which Ipopt asks for
   accuracy.

   Slacks are found by their place, not by their number: unknowns that meet one other, the row. A row may have several,
   as those of an elastic program do. Then one of them, with the smallest sigma / e^2, is that of the block, and the
   others go before it, each with its sigma as a pivot, by which delta falls. Any symmetric matrix is solved, with few
   slacks only more slowly.

   Ipopt loads this library as it does HSL's. So the four functions at the end have the names and arguments of HSL's
   MA27, as the user's guide of Ipopt has them. The factors lie in the arrays that Ipopt keeps between the calls. */
#include <math.h>
#include <stdint.h>
#include <string.h>

int32_t ldl_factor(double *A, int32_t c, int32_t *swaps, double *work); /* in dense_ldl.c */
void ldl_solve(const double *A, int32_t c, const int32_t *swaps, double *x);

enum { OPTIONS = 30, TOLERANCES = 5, FACTS = 20 };
enum { FLAG, WHICH, REALS = 4, INTEGERS, NEGATIVE = 14 }; /* places of the facts that are told */
enum { OUT = -1, PAIR = -2 };                             /* places of an eliminated slack, of a row gone with it */
static const int32_t SINGULAR = -5;

/* Views of Ipopt's two arrays: numbers that Ipopt keeps between factorisation and solution. */
typedef struct {
  int32_t *core;                      /* (n) place in the core, OUT or PAIR */
  int32_t *row;                       /* (n) row of a slack that is out, else -1 */
  int32_t *slack;                     /* (n) slack in the block of a row that is gone, else -1 */
  int32_t *swaps;                     /* (n) of a pivot k: its other row, or -1 - that of a block of two */
  int32_t *first, *column;            /* (n + 1), (nz) entries of the rows that are gone, by place in the core */
  double *diagonal, *coupling, *work; /* (n) of the matrix, of a row without its other slacks; (n) e of a slack; (2 n) */
  double *entry;                      /* (nz) values at `column` */
  double *A;                          /* (c, c) lower triangle by columns: the core, then L and B */
} factors;

/* `integers` begins with the size of the core and the number of entries. */
static factors views(int32_t n, int32_t nz, int32_t *integers, double *reals) {
  factors f;
  f.core = integers + 2, f.row = f.core + n, f.slack = f.row + n, f.swaps = f.slack + n, f.first = f.swaps + n;
  f.column = f.first + n + 1;
  f.diagonal = reals + nz, f.coupling = f.diagonal + n, f.work = f.coupling + n, f.entry = f.work + 2 * n;
  f.A = f.entry + nz;
  return f;
}

static inline double determinant(const factors *f, int32_t s, int32_t r) {
  return f->diagonal[s] * f->diagonal[r] - f->coupling[s] * f->coupling[s];
}

/* Slacks by the structure alone: row (n) of a slack, else -1; head (n) the first slack of a row, and next (n) the one
   after a slack, else -1. */
static void find(int32_t n, int32_t nz, const int32_t *row, const int32_t *col, int32_t *of, int32_t *head,
                 int32_t *next, int32_t *degree, int32_t *met) {
  for (int32_t i = 0; i < n; i++) degree[i] = 0, met[i] = of[i] = head[i] = next[i] = -1;
  for (int32_t t = 0; t < nz; t++)
    if (row[t] != col[t]) {
      int32_t i = row[t] - 1, j = col[t] - 1;
      degree[i]++, degree[j]++, met[i] = j, met[j] = i;
    }
  for (int32_t s = 0; s < n; s++)
    if (degree[s] == 1 && degree[met[s]] > 1) of[s] = met[s], next[s] = head[met[s]], head[met[s]] = s;
  for (int32_t t = 0; t < nz; t++) { /* of two rows that meet, one stays with its slacks */
    int32_t i = row[t] - 1, j = col[t] - 1;
    if (i == j || head[i] < 0 || head[j] < 0) continue;
    for (int32_t s = head[j]; s >= 0; s = next[s]) of[s] = -1;
    head[j] = -1;
  }
}

/* The slack of the block of a row, if the row and its slacks can go: no barrier is negative, and others than that of
   the block are positive. Else -1. */
static int32_t main_slack(int32_t r, const int32_t *head, const int32_t *next, const factors *f) {
  int32_t best = head[r];
  for (int32_t s = head[r]; s >= 0; s = next[s]) {
    double own = f->diagonal[s] * f->coupling[best] * f->coupling[best];
    if (own < f->diagonal[best] * f->coupling[s] * f->coupling[s]) best = s;
  }
  for (int32_t s = head[r]; s >= 0; s = next[s])
    if (!(s == best ? f->diagonal[s] >= 0 : f->diagonal[s] > 0)) return -1;
  return f->diagonal[r] <= 0 ? best : -1;
}

/* Take a slack out, with its sigma as the pivot. */
static void take(int32_t s, int32_t r, factors *f) {
  f->diagonal[r] -= f->coupling[s] * f->coupling[s] / f->diagonal[s];
  f->core[s] = OUT, f->row[s] = r;
}

/* Decide what goes; returns the size of the core. `largest` (n) is the largest entry of a row beside its slacks'. */
static int32_t choose(int32_t n, const int32_t *of, const int32_t *head, const int32_t *next, const double *largest,
                      double u, factors *f, int32_t *pairs) {
  int32_t size = 0;
  *pairs = 0;
  for (int32_t i = 0; i < n; i++) {
    f->row[i] = f->slack[i] = -1;
    if (of[i] < 0 && head[i] < 0) f->core[i] = size++;
  }
  for (int32_t r = 0; r < n; r++) {
    if (head[r] < 0) continue;
    int32_t block = main_slack(r, head, next, f);
    if (block < 0) {
      for (int32_t s = head[r]; s >= 0; s = next[s]) f->core[s] = size++;
      f->core[r] = size++;
      continue;
    }
    for (int32_t s = head[r]; s >= 0; s = next[s])
      if (s != block) take(s, r, f);
    double det = determinant(f, block, r);
    if (u * f->diagonal[block] * largest[r] <= -det) {
      f->core[block] = OUT, f->core[r] = PAIR, f->slack[r] = block, ++*pairs;
    } else {
      take(block, r, f);
      f->core[r] = size++;
    }
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
  for (int32_t i = 0; i < n; i++)
    if (f->core[i] >= 0) f->A[f->core[i] * (size_t)(size + 1)] += f->diagonal[i];
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

void ma27id_(int32_t *options, double *tolerances) {
  memset(options, 0, OPTIONS * sizeof *options);
  memset(tolerances, 0, TOLERANCES * sizeof *tolerances);
}

/* Analyse the structure. `keep` (3 n) is given to the factorisation, `spare` (2 n) is not. */
void ma27ad_(const int32_t *n, const int32_t *nz, const int32_t *row, const int32_t *col, int32_t *integers,
             const int32_t *integers_size, int32_t *keep, int32_t *spare, int32_t *steps, const int32_t *flag,
             const int32_t *options, const double *tolerances, int32_t *facts, double *operations) {
  memset(facts, 0, FACTS * sizeof *facts);
  find(*n, *nz, row, col, keep, keep + *n, keep + 2 * *n, spare, spare + *n);
  *steps = *n, *operations = 0;
  facts[REALS] = 2 * *nz + 4 * *n + *n * *n;
  facts[INTEGERS] = 5 * *n + *nz + 3;
}

/* Factor the matrix with values in `reals` (nz first). `spare` (2 n). Tells the number of negative eigenvalues. */
void ma27bd_(const int32_t *n, const int32_t *nz, const int32_t *row, const int32_t *col, double *reals,
             const int32_t *reals_size, int32_t *integers, const int32_t *integers_size, const int32_t *keep,
             const int32_t *steps, int32_t *longest, int32_t *spare, const int32_t *options, const double *tolerances,
             int32_t *facts) {
  const int32_t *of = keep, *head = keep + *n, *next = keep + 2 * *n;
  factors f = views(*n, *nz, integers, reals);
  int32_t pairs, negative;
  integers[1] = *nz;
  memset(facts, 0, FACTS * sizeof *facts);
  for (int32_t i = 0; i < *n; i++) f.diagonal[i] = f.coupling[i] = f.work[i] = f.first[i + 1] = 0;
  for (int32_t t = 0; t < *nz; t++) {
    int32_t i = row[t] - 1, j = col[t] - 1;
    double size = fabs(reals[t]);
    if (i == j) f.diagonal[i] += reals[t];
    else if (of[i] == j) f.coupling[i] += reals[t];
    else if (of[j] == i) f.coupling[j] += reals[t];
    else {
      f.first[i + 1]++, f.first[j + 1]++;
      if (size > f.work[i]) f.work[i] = size;
      if (size > f.work[j]) f.work[j] = size;
    }
  }
  f.first[0] = 0;
  integers[0] = choose(*n, of, head, next, f.work, tolerances[0], &f, &pairs);
  for (int32_t r = 0; r < *n; r++) f.first[r + 1] = f.first[r] + (f.core[r] == PAIR ? f.first[r + 1] : 0);
  sort(*n, *nz, row, col, reals, integers[0], &f);
  condense(*n, integers[0], f.swaps, &f);
  negative = ldl_factor(f.A, integers[0], f.swaps, f.work);
  *longest = *n, facts[NEGATIVE] = pairs + negative;
  if (negative < 0) facts[FLAG] = SINGULAR, facts[WHICH] = -negative;
}

/* Solve for a right-hand side (n), in place; `x` (n) is work. */
void ma27cd_(const int32_t *n, double *reals, const int32_t *reals_size, int32_t *integers,
             const int32_t *integers_size, double *x, const int32_t *longest, double *rhs, int32_t *spare,
             const int32_t *steps, const int32_t *options, const double *tolerances) {
  factors f = views(*n, integers[1], integers, reals);
  for (int32_t s = 0; s < *n; s++)
    if (f.row[s] >= 0) rhs[f.row[s]] -= f.coupling[s] * rhs[s] / f.diagonal[s];
  for (int32_t i = 0; i < *n; i++)
    if (f.core[i] >= 0) x[f.core[i]] = rhs[i];
  for (int32_t r = 0; r < *n; r++) {
    int32_t s = f.slack[r];
    if (s < 0) continue;
    double y = (f.diagonal[s] * rhs[r] - f.coupling[s] * rhs[s]) / determinant(&f, s, r);
    for (int32_t p = f.first[r]; p < f.first[r + 1]; p++) x[f.column[p]] -= f.entry[p] * y;
  }
  ldl_solve(f.A, integers[0], f.swaps, x);
  for (int32_t i = 0; i < *n; i++)
    if (f.core[i] >= 0) rhs[i] = x[f.core[i]];
  for (int32_t r = 0; r < *n; r++) {
    int32_t s = f.slack[r];
    if (s < 0) continue;
    double sigma = f.diagonal[s], e = f.coupling[s], det = determinant(&f, s, r), b = rhs[s];
    for (int32_t p = f.first[r]; p < f.first[r + 1]; p++) rhs[r] -= f.entry[p] * x[f.column[p]];
    rhs[s] = (f.diagonal[r] * b - e * rhs[r]) / det, rhs[r] = (sigma * rhs[r] - e * b) / det;
  }
  for (int32_t s = 0; s < *n; s++)
    if (f.row[s] >= 0) rhs[s] = (rhs[s] - f.coupling[s] * rhs[f.row[s]]) / f.diagonal[s];
}
