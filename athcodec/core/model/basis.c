/* The orthonormal bases of the motion model: cantilever modes along a piece, affine functions of a sheet, waves in
 * time. FORMAT.md, "Bases", states the same operations in the same order; nothing here may be reordered. */
#include "model/basis.h"

#define PI 3.14159265358979323846
#define HALF_ROOT_3 0.86602540378443864676

/* Share of a function's squared length that must remain after projection for it to join a basis. */
#define LEFT 1e-10

enum { MOST_PROBES = 64, MOST_ROWS = ATH_SEGMENT_FRAMES, MODE_STEPS = 32 };

/* Householder reduction of the symmetric n x n matrix `a` to tridiagonal form; on return row i of `q` is the i-th basis
 * vector in which the matrix is tridiagonal (diagonal d, subdiagonal e[1..n-1]). Rounding makes the matrix unsymmetric.
 * `a` is column-major, so that the sums of the rows run side by side. */
ATH_HOT static void tridiagonalise(int32_t n, double *ATH_RESTRICT a, double *ATH_RESTRICT q, double *d, double *e)
{
    double v[MOST_ROWS], p[MOST_ROWS], sums[MOST_ROWS];
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j < n; j++) q[i * n + j] = i == j ? 1.0 : 0.0;
    for (int32_t k = 0; k + 2 < n; k++) {
        double norm2 = 0.0, *column = a + k * n;
        for (int32_t i = k + 1; i < n; i++) norm2 = norm2 + column[i] * column[i];
        double below2 = norm2 - column[k + 1] * column[k + 1];
        if (!(below2 > norm2 * 1e-30)) continue;
        double norm = ath_sqrt(norm2), head = column[k + 1];
        double alpha = head > 0.0 ? -norm : norm;
        double scale = 1.0 / (norm2 - head * alpha); /* 2 / v.v, halved: v.v = 2 (norm2 - head alpha) */
        v[k + 1] = head - alpha;
        for (int32_t i = k + 2; i < n; i++) v[i] = column[i];
        double vp = 0.0;
        for (int32_t i = k + 1; i < n; i++) p[i] = 0.0;
        for (int32_t j = k + 1; j < n; j++)
            for (int32_t i = k + 1; i < n; i++) p[i] = p[i] + a[j * n + i] * v[j];
        for (int32_t i = k + 1; i < n; i++) p[i] = p[i] * scale;
        for (int32_t i = k + 1; i < n; i++) vp = vp + v[i] * p[i];
        double half = 0.5 * scale * vp;
        for (int32_t i = k + 1; i < n; i++) p[i] = p[i] - half * v[i];
        for (int32_t j = k + 1; j < n; j++)
            for (int32_t i = k + 1; i < n; i++) a[j * n + i] = a[j * n + i] - v[i] * p[j] - p[i] * v[j];
        a[(k + 1) * n + k] = alpha;
        column[k + 1] = alpha;
        for (int32_t i = k + 2; i < n; i++) a[i * n + k] = column[i] = 0.0;
        for (int32_t j = 0; j < n; j++) sums[j] = 0.0;
        for (int32_t i = k + 1; i < n; i++)
            for (int32_t j = 0; j < n; j++) sums[j] = sums[j] + v[i] * q[i * n + j];
        for (int32_t j = 0; j < n; j++) sums[j] = sums[j] * scale;
        for (int32_t i = k + 1; i < n; i++)
            for (int32_t j = 0; j < n; j++) q[i * n + j] = q[i * n + j] - sums[j] * v[i];
    }
    for (int32_t i = 0; i < n; i++) {
        d[i] = a[i * n + i];
        e[i] = i > 0 ? a[(i - 1) * n + i] : 0.0;
    }
}

ATH_INLINE void rotate_rows(int32_t n, double c, double s, double *ATH_RESTRICT low, double *ATH_RESTRICT high)
{
    for (int32_t k = 0; k < n; k++) {
        double h = high[k], w = low[k];
        high[k] = s * w + c * h;
        low[k] = c * w - s * h;
    }
}

/* Implicit QL on the tridiagonal matrix; rotates the rows of q into eigenvectors. The iteration count is capped, so
 * that the time is bounded for every input; the cap is never reached by the matrices of cantilever(). */
ATH_HOT static void diagonalise(int32_t n, double *d, double *e, double *q)
{
    for (int32_t i = 1; i < n; i++) e[i - 1] = e[i];
    e[n - 1] = 0.0;
    for (int32_t l = 0; l < n; l++) {
        for (int32_t iteration = 0; iteration < 50; iteration++) {
            int32_t m = l;
            for (; m < n - 1; m++) {
                double size = (d[m] < 0 ? -d[m] : d[m]) + (d[m + 1] < 0 ? -d[m + 1] : d[m + 1]);
                double off = e[m] < 0 ? -e[m] : e[m];
                if (!(off > size * 1e-16)) break;
            }
            if (m == l) break;
            double g = (d[l + 1] - d[l]) / (2.0 * e[l]);
            double r = ath_sqrt(g * g + 1.0);
            g = d[m] - d[l] + e[l] / (g >= 0.0 ? g + r : g - r);
            double s = 1.0, c = 1.0, p = 0.0;
            int32_t i = m - 1;
            for (; i >= l; i--) {
                double f = s * e[i], b = c * e[i], c_before = c, s_before = s;
                r = ath_sqrt(f * f + g * g);
                e[i + 1] = r;
                if (r == 0.0) {
                    d[i + 1] = d[i + 1] - p;
                    e[m] = 0.0;
                    break;
                }
                s = f / r;
                c = g / r;
                g = d[i + 1] - p;
                r = (d[i] - g) * s + 2.0 * c * b;
                p = s * r;
                d[i + 1] = g + p;
                g = c * r - b;
                /* Rows turn one rotation later, when they no longer wait for its numbers. */
                if (i < m - 1) rotate_rows(n, c_before, s_before, q + (i + 1) * n, q + (i + 2) * n);
            }
            if (i < m - 1) rotate_rows(n, c, s, q + (i + 1) * n, q + (i + 2) * n);
            if (r == 0.0 && i >= l) continue;
            d[l] = d[l] - p;
            e[l] = g;
            e[m] = 0.0;
        }
    }
}

/* Fills the eigenvalues in descending order, and a row per eigenvector, with a last number >= 0. Destroys `a`. */
static void eigenvectors(int32_t n, double *a, double *q, double *values, double *vectors)
{
    double d[MOST_ROWS], e[MOST_ROWS];
    tridiagonalise(n, a, q, d, e);
    diagonalise(n, d, e, q);
    for (int32_t m = 0; m < n; m++) {
        int32_t best = 0;
        for (int32_t i = 1; i < n; i++)
            if (d[i] > d[best]) best = i;
        double sign = q[best * n + n - 1] < 0.0 ? -1.0 : 1.0;
        for (int32_t i = 0; i < n; i++) vectors[m * n + i] = sign * q[best * n + i];
        values[m] = d[best];
        d[best] = -1e300;
    }
}

/* Fills the modes of a randomly bent cantilever: eigenvectors, largest eigenvalue first, of its covariance at the arc
 * lengths that `gaps` (small positive integers) add up to. The covariance is that of an integrated Wiener process, of
 * free rotation by `turn`, and of roughness. Modes are orthonormal if the last vertex has the weight `tip`. */
static void cantilever(int32_t n, const uint8_t *gaps, double turn, double rough, double tip, double *basis,
                       double *work)
{
    double s[ATH_PIECE_VERTICES], *a = work, *q = work + n * n, root = ath_sqrt(tip);
    int32_t total = 0, along = 0;
    for (int32_t i = 0; i < n; i++) total += gaps[i];
    for (int32_t i = 0; i < n; i++) {
        along += gaps[i];
        s[i] = (double)along / (double)total;
    }
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j <= i; j++) {
            double low = s[j], high = s[i];
            double bend = low * low * (3.0 * high - low) / 6.0;
            a[i * n + j] = a[j * n + i] = bend + turn * (low * high) + rough * low;
        }
    for (int32_t i = 0; i < n; i++) a[i * n + n - 1] = a[i * n + n - 1] * root;
    for (int32_t i = 0; i < n; i++) a[(n - 1) * n + i] = a[(n - 1) * n + i] * root;
    eigenvectors(n, a, q, s, basis);
    for (int32_t m = 0; m < n; m++) basis[m * n + n - 1] = basis[m * n + n - 1] / root;
}

void ath_principal(int32_t count, int32_t n, double *matrices, double *work, double *values, double *vectors)
{
    for (int32_t i = 0; i < count; i++, matrices += n * n, values += n, vectors += n * n)
        eigenvectors(n, matrices, work, values, vectors);
}

void ath_rest_basis(int32_t n, double *basis, double *work)
{
    uint8_t even[ATH_PIECE_VERTICES];
    memset(even, 1, sizeof even);
    cantilever(n, even, 100.0, 0.0, 1.0, basis, work);
}

/* Adds `candidate` to the `count` orthonormal rows of `basis`, its projections on them subtracted, twice for accuracy.
 * Returns the new count: unchanged where less than `keep` of its squared length remains. */
static int32_t append_orthonormal(int32_t n, double *basis, int32_t count, double *candidate, double keep)
{
    double before = 0.0, after = 0.0;
    for (int32_t i = 0; i < n; i++) before = before + candidate[i] * candidate[i];
    for (int32_t pass = 0; pass < 2; pass++)
        for (int32_t m = 0; m < count; m++) {
            double dot = 0.0;
            for (int32_t i = 0; i < n; i++) dot = dot + basis[m * n + i] * candidate[i];
            for (int32_t i = 0; i < n; i++) candidate[i] = candidate[i] - dot * basis[m * n + i];
        }
    for (int32_t i = 0; i < n; i++) after = after + candidate[i] * candidate[i];
    if (!(after > before * keep)) return count;
    double scale = 1.0 / ath_sqrt(after);
    for (int32_t i = 0; i < n; i++) basis[count * n + i] = candidate[i] * scale;
    return count + 1;
}

static double distance(const double *a, const double *b)
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return ath_sqrt(x * x + y * y + z * z);
}

/* Rounds lengths to quarters of their mean, 1 to 64: coarse enough that evenly meshed stems share one basis, and never
 * 0, so that coincident vertices do no harm. */
static void quarters_of_mean(int32_t count, const double *lengths, uint8_t *gaps)
{
    double total = 0.0;
    for (int32_t i = 0; i < count; i++) total = total + lengths[i];
    for (int32_t i = 0; i < count; i++) {
        double quarters = total > 0.0 ? 4.0 * lengths[i] * (double)count / total + 0.5 : 4.0;
        gaps[i] = (uint8_t)(quarters >= 64.0 ? 64 : quarters >= 1.0 ? (int32_t)quarters : 1);
    }
}

enum { MOST_RINGS = ATH_PIECE_VERTICES / 2 };

/* Fills the centres of a piece's rings, and the modes of a cantilever along the centres, rings x rings. */
static void modes_of_rings(const ath_piece *piece, const double *rest, double centres[][3], double *modes)
{
    int32_t rings = ath_rings(piece);
    const double *before = rest + 3 * (size_t)(piece->attach >= 0 ? piece->attach : piece->first);
    double lengths[MOST_RINGS] = {0.0}, work[2 * MOST_RINGS * MOST_RINGS];
    uint8_t gaps[MOST_RINGS] = {0};
    for (int32_t r = 0; r < rings; r++) {
        int32_t from = r * piece->ring, to = ath_min(from + piece->ring, piece->count);
        for (int32_t k = 0; k < 3; k++) {
            double sum = 0.0;
            for (int32_t i = from; i < to; i++) sum = sum + rest[3 * (size_t)(piece->first + i) + (size_t)k];
            centres[r][k] = sum / (double)(to - from);
        }
        lengths[r] = distance(centres[r], before);
        before = centres[r];
    }
    quarters_of_mean(rings, lengths, gaps);
    cantilever(rings, gaps, 0.1, 0.001, 1.0, modes, work);
}

/* Fills the basis of a tube: rings that move without deforming along a cantilever, then affine functions across all
 * rings, then those across single rings, then the modes of an evenly spaced cantilever. Returns the rank. */
static int32_t tube(const ath_piece *piece, const double *rest, const double *modes, double *basis)
{
    int32_t n = piece->count, rank = 0, rings = ath_rings(piece);
    double centres[MOST_RINGS][3], along[MOST_RINGS * MOST_RINGS], across[3][ATH_PIECE_VERTICES];
    double candidate[ATH_PIECE_VERTICES];
    modes_of_rings(piece, rest, centres, along);
    for (int32_t m = 0; m < rings; m++) {
        for (int32_t i = 0; i < n; i++) candidate[i] = along[m * rings + i / piece->ring];
        rank = append_orthonormal(n, basis, rank, candidate, LEFT);
    }
    for (int32_t k = 0; k < 3; k++) {
        for (int32_t i = 0; i < n; i++)
            across[k][i] = rest[3 * (size_t)(piece->first + i) + (size_t)k] - centres[i / piece->ring][k];
        memcpy(candidate, across[k], (size_t)n * sizeof(double));
        if (rank < n) rank = append_orthonormal(n, basis, rank, candidate, LEFT);
    }
    for (int32_t m = 0; m < rings; m++)
        for (int32_t k = 0; k < 3 && rank < n; k++) {
            for (int32_t i = 0; i < n; i++) candidate[i] = along[m * rings + i / piece->ring] * across[k][i];
            rank = append_orthonormal(n, basis, rank, candidate, LEFT);
        }
    for (int32_t m = 0; m < n && rank < n; m++) {
        memcpy(candidate, modes + m * n, (size_t)n * sizeof(double));
        rank = append_orthonormal(n, basis, rank, candidate, LEFT);
    }
    return rank;
}

/* Fills the basis of a sheet: the functions x0 - a over its vertices (flat and straight pieces have fewer than three),
 * then what is left of the modes of an evenly spaced cantilever. Returns the rank. */
static int32_t sheet(const ath_piece *piece, const double *rest, const double *modes, double *basis)
{
    int32_t n = piece->count, rank = 0;
    double column[3][ATH_PIECE_VERTICES], length2[3], candidate[ATH_PIECE_VERTICES];
    const double *origin = rest + 3 * (size_t)(piece->attach >= 0 ? piece->attach : piece->first);
    for (int32_t k = 0; k < 3; k++) {
        length2[k] = 0.0;
        for (int32_t i = 0; i < n; i++) {
            column[k][i] = rest[3 * (size_t)(piece->first + i) + (size_t)k] - origin[k];
            length2[k] = length2[k] + column[k][i] * column[k][i];
        }
    }
    for (int32_t taken = 0; taken < 3; taken++) {
        int32_t best = 0;
        for (int32_t k = 1; k < 3; k++)
            if (length2[k] > length2[best]) best = k;
        if (length2[best] > 0.0 && rank < n) rank = append_orthonormal(n, basis, rank, column[best], 1e-4);
        length2[best] = -1.0;
    }
    for (int32_t m = 0; m < n && rank < n; m++) {
        memcpy(candidate, modes + m * n, (size_t)n * sizeof(double));
        rank = append_orthonormal(n, basis, rank, candidate, LEFT);
    }
    return rank;
}

/* Fills the gaps along a piece. Sheets count as evenly spaced. */
static void piece_gaps(const ath_piece *piece, const double *rest, uint8_t *gaps)
{
    double length[ATH_PIECE_VERTICES];
    const double *before = rest + 3 * (size_t)(piece->attach >= 0 ? piece->attach : piece->first);
    for (int32_t i = 0; i < piece->count; i++) {
        const double *here = rest + 3 * (size_t)(piece->first + i);
        length[i] = piece->flags & ATH_SHEET ? 0.0 : distance(here, before);
        before = here;
    }
    quarters_of_mean(piece->count, length, gaps);
}

static uint32_t gaps_hash(const uint8_t *gaps, int32_t n)
{
    uint32_t hash = 2166136261u;
    for (int32_t i = 0; i < n; i++) hash = (hash ^ gaps[i]) * 16777619u;
    return hash ^ (hash >> 15);
}

static int same_gaps(const uint8_t *a, const uint8_t *b, int32_t n)
{
    for (int32_t i = 0; i < n; i++)
        if (a[i] != b[i]) return 0;
    return 1;
}

/* Returns 2 for a nearly straight cantilever, whose errors are largest at the tip, else 1. */
static int32_t tip_weight(const ath_piece *piece, const double *rest)
{
    const double *base = rest + 3 * (size_t)(piece->attach >= 0 ? piece->attach : piece->first), *before = base;
    double way = 0.0;
    for (int32_t i = 0; i < piece->count; i++) {
        const double *here = rest + 3 * (size_t)(piece->first + i);
        way = way + distance(here, before);
        before = here;
    }
    return !(piece->flags & ATH_SHEET) && piece->count > 1 && 2.0 * way <= 3.0 * distance(before, base) ? 2 : 1;
}

/* Returns the piece whose basis piece p shares, since gaps and weights are equal. `table` is an open-addressing hash of
 * the pieces that own their basis. A hostile file may make all of them collide: after MOST_PROBES probes a piece gets
 * its own basis with the same numbers. */
static int32_t owner_of_basis(const ath_piece *pieces, int32_t p, const uint8_t *gaps, int32_t *table, uint32_t mask)
{
    const uint8_t *mine = gaps + pieces[p].first;
    uint32_t at = gaps_hash(mine, pieces[p].count) & mask;
    for (int32_t probe = 0; table[at] >= 0; probe++) {
        const ath_piece *other = pieces + table[at];
        if (other->count == pieces[p].count && same_gaps(mine, gaps + other->first, other->count)
            && other->tip_weight == pieces[p].tip_weight)
            return table[at];
        if (probe == MOST_PROBES) return p;
        at = (at + 1) & mask;
    }
    table[at] = p;
    return p;
}

size_t ath_basis_table_size(int32_t piece_count)
{
    size_t size = 16;
    while (size < 2 * (size_t)piece_count) size *= 2;
    return size;
}

int64_t ath_basis_layout(ath_piece *pieces, int32_t piece_count, const double *rest, uint8_t *gaps, int32_t *table)
{
    int64_t next = 0;
    size_t size = ath_basis_table_size(piece_count);
    for (size_t i = 0; i < size; i++) table[i] = -1;
    for (int32_t p = 0; p < piece_count; p++) {
        ath_piece *piece = pieces + p;
        piece_gaps(piece, rest, gaps + piece->first);
        piece->tip_weight = tip_weight(piece, rest);
        ath_piece *owner = pieces + owner_of_basis(pieces, p, gaps, table, (uint32_t)size - 1);
        int32_t stage = ath_base_stage(piece);
        piece->rank = piece->count;
        piece->modes = owner == piece ? next : owner->modes;
        piece->modes_stage = -1;
        owner->modes_stage = owner == piece ? stage : ath_min(owner->modes_stage, stage);
        if (owner == piece) next += (int64_t)piece->count * piece->count;
        piece->basis = piece->modes;
        if (piece->flags & ATH_SHEET) {
            piece->basis = next;
            next += (int64_t)piece->count * piece->count;
        }
    }
    return next;
}

/* Copies a piece's modes from another plan and returns 1 if they are the same there. */
static int take_modes(const ath_plan *before, int32_t p, const ath_piece *piece, const uint8_t *gaps, double *modes)
{
    uint8_t known[ATH_PIECE_VERTICES];
    if (!before) return 0;
    const ath_piece *other = before->pieces + p;
    piece_gaps(other, before->rest, known);
    if (!same_gaps(known, gaps, piece->count) || other->tip_weight != piece->tip_weight) return 0;
    memcpy(modes, before->bases + other->modes, (size_t)piece->count * (size_t)piece->count * sizeof *modes);
    return 1;
}

static int is_between(int32_t stage, int32_t first, int32_t last) { return first <= stage && stage <= last; }

static void fill_modes(const ath_piece *pieces, int32_t p, const double *rest, const ath_plan *before, double *work,
                       double *bases)
{
    uint8_t gaps[ATH_PIECE_VERTICES];
    const ath_piece *piece = pieces + p;
    piece_gaps(piece, rest, gaps);
    if (!take_modes(before, p, piece, gaps, bases + piece->modes))
        cantilever(piece->count, gaps, 0.1, 0.001, piece->tip_weight, bases + piece->modes, work);
}

void ath_basis_modes(const ath_piece *pieces, int32_t first, int32_t stop, const double *rest, double *work,
                     double *bases)
{
    for (int32_t p = first; p < stop; p++)
        if (pieces[p].modes_stage >= 0) fill_modes(pieces, p, rest, 0, work, bases);
}

static void fill_sheet(ath_piece *piece, const double *rest, double *bases)
{
    const double *modes = bases + piece->modes;
    piece->rank = (piece->ring > 0 ? tube : sheet)(piece, rest, modes, bases + piece->basis);
}

void ath_basis_sheets(ath_piece *pieces, int32_t first, int32_t stop, const double *rest, double *bases)
{
    for (ath_piece *piece = pieces + first; piece < pieces + stop; piece++) /* rigid pieces use no basis */
        if (piece->flags & ATH_SHEET && !(piece->flags & ATH_RIGID)) fill_sheet(piece, rest, bases);
}

int ath_basis_fill(ath_piece *pieces, int32_t *next, int32_t piece_count, int32_t first_stage, int32_t last_stage,
                   const double *rest, const ath_plan *before, double *work, double *bases, int32_t *cost)
{
    for (; *next < piece_count; ++*next) { /* a sheet shares modes with a piece before it alone */
        ath_piece *piece = pieces + *next;
        int has_modes = is_between(piece->modes_stage, first_stage, last_stage);
        int is_sheet = piece->flags & ATH_SHEET && is_between(ath_base_stage(piece), first_stage, last_stage);
        if (!ath_spend(cost, 1 + 4 * (has_modes + is_sheet) * piece->count * piece->count)) return ATH_MORE;
        if (has_modes) fill_modes(pieces, *next, rest, before, work, bases);
        if (is_sheet) fill_sheet(piece, rest, bases);
    }
    *next = 0;
    return ATH_OK;
}

/* Series of cos(x) and sin(x) for 0 <= x <= pi/4. */
static double cos_series(double x)
{
    double x2 = x * x, sum = 1.0;
    for (int32_t k = 18; k >= 2; k -= 2) sum = 1.0 - sum * x2 / (double)(k * (k - 1));
    return sum;
}

static double sin_series(double x)
{
    double x2 = x * x, sum = 1.0;
    for (int32_t k = 19; k >= 3; k -= 2) sum = 1.0 - sum * x2 / (double)(k * (k - 1));
    return x * sum;
}

/* Returns cos(pi j / (2 T)), by symmetry from the first eighth of the circle. */
static double cos_of_fraction(int64_t j, int64_t T)
{
    j = j % (4 * T);
    if (j > 2 * T) j = 4 * T - j;
    double sign = 1.0;
    if (j > T) {
        j = 2 * T - j;
        sign = -1.0;
    }
    double value =
        2 * j <= T ? cos_series(PI * (double)j / (double)(2 * T)) : sin_series(PI * (double)(T - j) / (double)(2 * T));
    return sign * value;
}

/* Fills a real Fourier series. A sine is a cosine a quarter of a turn later. */
static void periodic_waves(int32_t frames, double *waves)
{
    double once = ath_sqrt(1.0 / (double)frames), twice = ath_sqrt(2.0 / (double)frames);
    for (int32_t k = 0; k < frames; k++) {
        int64_t turns = (k + 1) / 2, later = k > 0 && k % 2 == 0 ? 3 * frames : 0;
        double size = k == 0 || 2 * turns == frames ? once : twice;
        for (int32_t t = 0; t < frames; t++)
            waves[k * frames + t] = size * cos_of_fraction(4 * turns * t + later, frames);
    }
}

/* 0 <= x <= pi / 2 */
static double cos_of(double x) { return x <= 0.25 * PI ? cos_series(x) : sin_series(0.5 * PI - x); }
static double sin_of(double x) { return x <= 0.25 * PI ? sin_series(x) : cos_series(0.5 * PI - x); }

/* x >= 0. The series runs at a quarter of the angle. */
static double atan_of(double x)
{
    if (x > 1.0) return 0.5 * PI - atan_of(1.0 / x);
    double half = x / (1.0 + ath_sqrt(1.0 + x * x)), quarter = half / (1.0 + ath_sqrt(1.0 + half * half)), sum = 0.0;
    for (int32_t k = 25; k > 0; k -= 2) sum = 1.0 / (double)k - sum * (quarter * quarter);
    return 4.0 * (quarter * sum);
}

typedef struct {
    double re, im;
} complex_number;

static complex_number times(complex_number a, complex_number b)
{
    complex_number product = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return product;
}

static complex_number power(complex_number x, int32_t n)
{
    complex_number product = {1.0, 0.0};
    for (; n > 0; n /= 2) {
        if (n % 2 == 1) product = times(product, x);
        x = times(x, x);
    }
    return product;
}

/* Constants of the modes of second or third differences. A mode is a cosine plus terms that decay from the ends. */
typedef struct {
    complex_number root; /* wave number of the decaying term over that of the cosine */
    complex_number edge; /* decaying term at the end over the sine of the phase */
    complex_number turn; /* edge / root^2 */
} mode_order;

static const mode_order SECOND = {{1.0, 0.0}, {1.0, 0.0}, {1.0, 0.0}},
                        THIRD = {{HALF_ROOT_3, -0.5}, {2.0 * HALF_ROOT_3, 1.0}, {0.0, 2.0}};

/* A mode: cos((2 t + 1) h + phase), and a term from either end that changes by the factor `decay` per half frame. */
typedef struct {
    double sine, cosine, slope; /* sin(h), cos(h), tan(phase) */
    complex_number decay;
    complex_number apart; /* 1 / (1 - the decayed term at the other end) */
} mode;

/* Returns mode k for a given h. Even modes are symmetric about the middle, odd ones antisymmetric. */
static mode mode_at(int32_t frames, int32_t k, double h, const mode_order *order)
{
    mode own = {sin_of(h), cos_of(h), 0.0, {0.0, 0.0}, {0.0, 0.0}};
    complex_number falls = {own.sine * order->root.re, own.sine * order->root.im}, square = times(falls, falls), root;
    double re = 1.0 + square.re, length = ath_sqrt(re * re + square.im * square.im);
    root.re = ath_sqrt(0.5 * (length + re));
    root.im = 0.5 * square.im / root.re;
    own.decay.re = root.re - falls.re;
    own.decay.im = root.im - falls.im;

    complex_number far = power(own.decay, 2 * frames);
    if (k % 2 == 1) far.re = -far.re, far.im = -far.im;
    double left = 1.0 - far.re, scale = 1.0 / (left * left + far.im * far.im);
    own.apart.re = left * scale;
    own.apart.im = far.im * scale;
    far.re = 1.0 + far.re;
    own.slope = own.cosine / times(times(order->turn, root), times(far, own.apart)).re;
    return own;
}

/* Solves 2 frames h = pi k - 2 phase(h). A step takes about ten bits off the error, with few frames two. */
static void find_modes(int32_t frames, int32_t first, int32_t count, const mode_order *order, mode *modes)
{
    double h[ATH_CHAINS];
    for (int32_t i = 0; i < count; i++) h[i] = PI * ((double)(first + i) - 0.5) / (double)(2 * frames);
    for (int32_t step = 0, moved = 1; moved && step <= MODE_STEPS; step++) {
        for (int32_t i = 0; i < count; i++) modes[i] = mode_at(frames, first + i, h[i], order);
        moved = 0;
        for (int32_t i = 0; i < count; i++) {
            double next = (0.5 * PI * (double)(first + i) - atan_of(modes[i].slope)) / (double)frames;
            moved |= next != h[i];
            h[i] = next;
        }
    }
}

static void unit_length(int32_t frames, double *wave)
{
    double length2 = 0.0;
    for (int32_t t = 0; t < frames; t++) length2 = length2 + wave[t] * wave[t];
    double scale = 1.0 / ath_sqrt(length2);
    for (int32_t t = 0; t < frames; t++) wave[t] = wave[t] * scale;
}

/* Fills `count` waves side by side, of which each step waits for the one before. */
static void mode_waves(int32_t frames, int32_t first, int32_t count, const mode_order *order, double *waves)
{
    double c[ATH_CHAINS], s[ATH_CHAINS], turn_c[ATH_CHAINS], turn_s[ATH_CHAINS];
    complex_number edge[ATH_CHAINS], decay[ATH_CHAINS];
    mode modes[ATH_CHAINS];
    find_modes(frames, first, count, order, modes);
    for (int32_t i = 0; i < count; i++) {
        const mode *own = modes + i;
        double cosine = 1.0 / ath_sqrt(1.0 + own->slope * own->slope), sine = own->slope * cosine;
        c[i] = own->cosine * cosine - own->sine * sine;
        s[i] = own->sine * cosine + own->cosine * sine;
        turn_c[i] = 1.0 - 2.0 * own->sine * own->sine;
        turn_s[i] = 2.0 * own->sine * own->cosine;
        complex_number side = {sine * order->edge.re, sine * order->edge.im};
        edge[i] = times(times(side, own->apart), own->decay);
        decay[i] = times(own->decay, own->decay);
    }
    for (int32_t t = 0; t < frames; t++)
        for (int32_t i = 0; i < count; i++) {
            waves[i * frames + t] = edge[i].re;
            edge[i] = times(edge[i], decay[i]);
        }
    for (int32_t t = 0; 2 * t < frames; t++)
        for (int32_t i = 0; i < count; i++) {
            double *low = waves + i * frames + t, *high = low + frames - 1 - 2 * t;
            double sign = (first + i) % 2 == 0 ? 1.0 : -1.0, x = c[i] + (*low + sign * *high);
            double turned = c[i] * turn_c[i] - s[i] * turn_s[i];
            *high = sign * x;
            *low = x;
            s[i] = s[i] * turn_c[i] + c[i] * turn_s[i];
            c[i] = turned;
        }
    for (int32_t i = 0; i < count; i++) unit_length(frames, waves + i * frames);
}

/* Fills polynomial k about the middle, orthogonal to those before: 1, t, t^2. */
static void polynomial_wave(int32_t frames, int32_t k, double *wave)
{
    double mean = (double)(frames * frames - 1) / 12.0;
    for (int32_t t = 0; t < frames; t++) {
        double way = 0.5 * (double)(frames - 1) - (double)t;
        wave[t] = k == 0 ? 1.0 : k == 1 ? way : way * way - mean;
    }
    unit_length(frames, wave);
}

void ath_waves(int32_t frames, int32_t kind, double *waves)
{
    if (kind == ATH_PERIODIC) {
        periodic_waves(frames, waves);
        return;
    }
    int32_t k = 0, polynomials = ath_min(frames, kind == ATH_BEAM ? 2 : 3);
    for (; k < polynomials; k++) polynomial_wave(frames, k, waves + k * frames);
    for (; k < frames; k += ATH_CHAINS)
        mode_waves(frames, k, ath_min(ATH_CHAINS, frames - k), kind == ATH_BEAM ? &SECOND : &THIRD, waves + k * frames);
}

double ath_tan_of_half(double x)
{
    double half = 0.5 * x;
    if (half <= 0.25 * PI) return sin_series(half) / cos_series(half);
    double rest = 0.5 * PI - half;
    return cos_series(rest) / sin_series(rest);
}
