/* Factors P L B L' P' of a dense symmetric matrix, with blocks B of one or two (Bunch & Kaufman 1977). */
#include <math.h>
#include <stdint.h>
#include <string.h>

static inline double larger(double a, double b) { return a > b ? a : b; } /* fmax is a call */

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

/* Factor A (c, c), given by the columns of its lower triangle. `swaps` (c) is for the solution, `work` (2 c) is not.
   Returns the number of negative eigenvalues, or -1 - k if pivot k is zero. */
int32_t ldl_factor(double *A, int32_t c, int32_t *swaps, double *work) {
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

/* x = A^-1 x with the factors of A. */
void ldl_solve(const double *A, int32_t c, const int32_t *swaps, double *x) {
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
