/* Products and decompositions of small matrices for the encoder, summed in one order: BLAS and LAPACK give other bits
 * with other processors and threads. */
#include "encode/encode.h"

enum { MOST_SWEEPS = 40 };

ATH_HOT void ath_multiply(int64_t count, int64_t rows, int64_t inner, int64_t columns, const double *a, int64_t a_step,
                          const double *b, int64_t b_step, double *ATH_RESTRICT out)
{
    for (int64_t i = 0; i < count; i++, a += a_step, b += b_step)
        for (int64_t r = 0; r < rows; r++, out += columns) {
            for (int64_t c = 0; c < columns; c++) out[c] = 0.0;
            for (int64_t k = 0; k < inner; k++) {
                double factor = a[r * inner + k];
                for (int64_t c = 0; c < columns; c++) out[c] += factor * b[k * columns + c];
            }
        }
}

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double magnitude(double number) { return number < 0.0 ? -number : number; }

static void cross(const double *a, const double *b, double *out)
{
    for (int32_t i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static void turn_rows(double c, double s, double *a, double *b)
{
    for (int32_t i = 0; i < 3; i++) {
        double x = a[i], y = b[i];
        a[i] = c * x - s * y;
        b[i] = s * x + c * y;
    }
}

/* Makes two rows of w orthogonal and turns the rows of v alike. Returns 0 if they were orthogonal. */
static int make_orthogonal(double *w, double *v, int32_t p, int32_t q)
{
    double *a = w + 3 * p, *b = w + 3 * q, both = dot3(a, b), a2 = dot3(a, a), b2 = dot3(b, b);
    if (!(magnitude(both) > 1e-16 * ath_sqrt(a2) * ath_sqrt(b2))) return 0;
    double zeta = (b2 - a2) / (2.0 * both);
    double tangent = (zeta < 0.0 ? -1.0 : 1.0) / (magnitude(zeta) + ath_sqrt(1.0 + zeta * zeta));
    double c = 1.0 / ath_sqrt(1.0 + tangent * tangent);
    turn_rows(c, c * tangent, a, b);
    turn_rows(c, c * tangent, v + 3 * p, v + 3 * q);
    return 1;
}

static void swap_rows(double *a, double *b)
{
    for (int32_t i = 0; i < 3; i++) {
        double number = a[i];
        a[i] = b[i];
        b[i] = number;
    }
}

/* Fills a unit vector at right angles to a unit vector. */
static void any_across(const double *a, double *out)
{
    int32_t least = 0;
    double axis[3] = {0.0, 0.0, 0.0};
    for (int32_t i = 1; i < 3; i++)
        if (magnitude(a[i]) < magnitude(a[least])) least = i;
    axis[least] = 1.0;
    cross(a, axis, out);
    double length = ath_sqrt(dot3(out, out));
    for (int32_t i = 0; i < 3; i++) out[i] /= length;
}

/* Normalises rows of falling length. A row that is too short is replaced by one that completes the others. */
static void make_units(double *w, double stretch[3])
{
    double least = 1e-14 * stretch[0];
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; stretch[i] > least && k < 3; k++) w[3 * i + k] /= stretch[i];
    if (!(stretch[0] > 0.0)) {
        w[0] = 1.0;
        w[1] = w[2] = 0.0;
    }
    if (!(stretch[1] > least)) any_across(w, w + 3);
    if (!(stretch[2] > least)) cross(w, w + 3, w + 6);
}

/* One-sided Jacobi rotations (Hestenes 1958) of the columns, kept as rows. */
static void decompose(const double *matrix, double *left, double stretch[3], double *right)
{
    double w[9], most = 0.0;
    for (int32_t i = 0; i < 9; i++) {
        w[i] = matrix[3 * (i % 3) + i / 3];
        right[i] = i % 4 == 0 ? 1.0 : 0.0;
        if (magnitude(w[i]) > most) most = magnitude(w[i]);
    }
    double scale = most > 0.0 ? most : 1.0; /* keeps squares from vanishing or overflowing */
    for (int32_t i = 0; i < 9; i++) w[i] /= scale;
    for (int32_t sweep = 0, turned = 1; turned && sweep < MOST_SWEEPS; sweep++) {
        turned = make_orthogonal(w, right, 0, 1);
        turned |= make_orthogonal(w, right, 0, 2);
        turned |= make_orthogonal(w, right, 1, 2);
    }
    for (int32_t i = 0; i < 3; i++) stretch[i] = ath_sqrt(dot3(w + 3 * i, w + 3 * i));
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; k < 2; k++)
            if (stretch[k] < stretch[k + 1]) {
                double length = stretch[k];
                stretch[k] = stretch[k + 1];
                stretch[k + 1] = length;
                swap_rows(w + 3 * k, w + 3 * k + 3);
                swap_rows(right + 3 * k, right + 3 * k + 3);
            }
    make_units(w, stretch);
    for (int32_t i = 0; i < 9; i++) left[i] = w[3 * (i % 3) + i / 3];
    for (int32_t i = 0; i < 3; i++) stretch[i] *= scale;
}

void ath_decompose(int64_t count, const double *matrices, double *left, double *stretch, double *right)
{
    for (int64_t i = 0; i < count; i++) decompose(matrices + 9 * i, left + 9 * i, stretch + 3 * i, right + 9 * i);
}

/* Replaces the lower triangle of a positive definite matrix by its Cholesky factor. */
static void factorise(int32_t n, double *matrix)
{
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j <= i; j++) {
            double left = matrix[i * n + j];
            for (int32_t k = 0; k < j; k++) left -= matrix[i * n + k] * matrix[j * n + k];
            matrix[i * n + j] = i == j ? ath_sqrt(left) : left / matrix[j * n + j];
        }
}

static void solve(int32_t n, int32_t columns, double *matrix, double *rows)
{
    factorise(n, matrix);
    for (int32_t pass = 0; pass < 2; pass++)
        for (int32_t step = 0; step < n; step++) {
            int32_t i = pass ? n - 1 - step : step;
            double *row = rows + (size_t)i * (size_t)columns;
            for (int32_t k = pass ? i + 1 : 0; k < (pass ? n : i); k++) {
                double factor = pass ? matrix[k * n + i] : matrix[i * n + k];
                for (int32_t c = 0; c < columns; c++) row[c] -= factor * rows[(size_t)k * (size_t)columns + (size_t)c];
            }
            for (int32_t c = 0; c < columns; c++) row[c] /= matrix[i * n + i];
        }
}

ATH_HOT void ath_solve(int64_t count, int32_t n, int32_t columns, double *matrices, double *rows)
{
    for (int64_t i = 0; i < count; i++, matrices += n * n, rows += n * columns) solve(n, columns, matrices, rows);
}
