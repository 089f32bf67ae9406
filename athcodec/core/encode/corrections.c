/* Finds corrections of decoded positions that keep the error bound: as few as possible, and such that the remaining
 * error moves as little as possible from frame to frame. */
#include "encode/encode.h"
#include <float.h>

/* Bits that are worth saving the mean squared second difference of a vertex's error. Bends show if little else moves:
 * LEAST_BEND, over limit^2, is the least that counts as moving. */
static const double BEND_BITS = 0.5, LEAST_BEND = 1.0 / 16;

/* One vertex over time: decoded and wanted positions, corrections so far, and the remaining error. */
typedef struct {
    int32_t frames, is_float64;
    int32_t closed; /* see ath_met_ends */
    int32_t worst;  /* the frame farthest beyond the limit; -1: none */
    double step, limit2;
    double decoded[ATH_SEGMENT_FRAMES][3], wanted[ATH_SEGMENT_FRAMES][3], error[ATH_SEGMENT_FRAMES][3];
    double squares[ATH_SEGMENT_FRAMES];  /* squared lengths of the errors */
    double bends[ATH_SEGMENT_FRAMES][3]; /* second differences of the error; 0 in the first and the last frame */
    double bend_bits;                    /* bits per unit of squared bends */
    ath_corrected_parts parts;
    ath_correction own[ATH_SEGMENT_FRAMES]; /* all zero: none */
} track;

typedef struct {
    int32_t frame;
    ath_correction own;
    double cost; /* bits for each frame that it brings within the limit */
} candidate;

static double square(const double e[3]) { return e[0] * e[0] + e[1] * e[1] + e[2] * e[2]; }

static int32_t length_of(int32_t steps) { return steps < 0 ? -steps : steps; }

static int is_any(const ath_correction *own) { return own->q[0] != 0 || own->q[1] != 0 || own->q[2] != 0; }

static int32_t first_frame(int32_t frame, int32_t away) { return ath_max(0, frame - away); }

static int32_t last_frame(const track *track, int32_t frame, int32_t away)
{
    return ath_min(track->frames - 1, frame + away);
}

/* Returns the error of a frame on an axis with `more` parts of a correction added. */
static double error_with(const track *track, int32_t t, int32_t k, double more)
{
    double parts = track->parts[t][k] + more, sum = track->decoded[t][k];
    if (parts != 0.0) sum = ath_corrected(sum, parts, track->step);
    return (track->is_float64 ? sum : ath_single(sum)) - track->wanted[t][k];
}

static void bend_frames(track *track, int32_t from, int32_t to)
{
    for (int32_t t = ath_max(1, from); t <= ath_min(track->frames - 2, to); t++)
        for (int32_t k = 0; k < 3; k++)
            track->bends[t][k] = track->error[t - 1][k] - 2.0 * track->error[t][k] + track->error[t + 1][k];
}

static void find_worst(track *track)
{
    double most = track->limit2;
    track->worst = -1;
    for (int32_t t = 0; t < track->frames; t++)
        if (track->squares[t] > most) {
            most = track->squares[t];
            track->worst = t;
        }
}

static void open_track(track *track, int32_t v, const void *positions, const double *source, const double origin[3],
                       double limit)
{
    size_t T = (size_t)track->frames;
    track->limit2 = limit * limit;
    for (size_t k = 0; k < 3; k++)
        for (size_t t = 0; t < T; t++) {
            size_t at = ((size_t)v * 3 + k) * T + t;
            track->decoded[t][k] = ath_number_at(positions, at, track->is_float64);
            track->wanted[t][k] = source[at] + origin[k];
            track->error[t][k] = track->decoded[t][k] - track->wanted[t][k];
        }
    for (size_t t = 0; t < T; t++) track->squares[t] = square(track->error[t]);
    memset(track->parts, 0, T * sizeof track->parts[0]);
    memset(track->own, 0, T * sizeof track->own[0]);
    find_worst(track);
}

/* Most vertices are within the limit in all frames. */
ATH_HOT static int is_within(int32_t frames, int is_float64, const void *positions, const double *source,
                             const double origin[3], double limit, size_t first)
{
    double squares[ATH_SEGMENT_FRAMES] = {0.0};
    int beyond = 0;
    for (size_t k = 0; k < 3; k++) {
        size_t row = first + k * (size_t)frames;
        for (int32_t t = 0; t < frames; t++) {
            double error =
                ath_number_at(positions, row + (size_t)t, is_float64) - (source[row + (size_t)t] + origin[k]);
            squares[t] += error * error;
        }
    }
    for (int32_t t = 0; t < frames; t++) beyond |= squares[t] > limit * limit;
    return !beyond;
}

/* Measures how much the error moves before it is corrected. */
static void weigh_bends(track *track)
{
    double sum = 0.0;
    bend_frames(track, 0, track->frames - 1);
    for (int32_t t = 1; t < track->frames - 1; t++) sum += square(track->bends[t]);
    track->bend_bits = BEND_BITS / (sum / track->frames + LEAST_BEND * track->limit2);
}

/* Estimates the bits of a correction. like: that of the vertex before in the same frame. */
static double estimated_bits(const ath_correction *own, const ath_correction *like)
{
    double bits = 2.0 + 3.0 * (like->width != own->width);
    if (is_any(like)) {
        for (int32_t k = 0; k < 3; k++) bits += 3.0 * (like->q[k] != own->q[k]);
        return bits;
    }
    bits = 8.0;
    for (int32_t k = 0; k < 3; k++)
        if (own->q[k] != 0) bits += 2.0 + 0.5 * ath_min(8, length_of(own->q[k]) - 1);
    return bits;
}

/* Corrections that are tried at a place are on each axis shorter than the whole one by fewer steps than this. */
enum { SIZES = 3 };

/* A place of a correction. */
typedef struct {
    int32_t frame, width;
    int32_t whole[3];           /* the correction that removes most of the worst frame's error */
    double still[3];            /* the worst frame's squared error by axis, as it is */
    double worst[3][SIZES];     /* and with the whole correction, and with shorter ones */
    double least[3];            /* the smallest of these */
    int32_t is_weighed, beyond; /* beyond: frames in reach that are beyond the limit */
    double slope[3], curve; /* the vector x in parts of a step adds x * (2 * slope + x * curve) to the squared bends */
} place;

/* Fills the frames of a footprint, which an end may cut off. */
static int32_t shown_part(const track *track, int32_t frame, int32_t width, int32_t t)
{
    return t >= 0 && t < track->frames ? ath_footprint_part(width, t - frame) : 0;
}

static int32_t footprint_bend(const track *track, int32_t frame, int32_t width, int32_t t)
{
    return shown_part(track, frame, width, t - 1) - 2 * shown_part(track, frame, width, t)
           + shown_part(track, frame, width, t + 1);
}

static int has_bend(const track *track, int32_t t) { return t > 0 && t < track->frames - 1; }

/* Fills how a correction changes the bends of the error, which few places need to know. Beyond an end that another
 * segment joins, the error goes on and the correction adds nothing. */
static void weigh_place(const track *track, place *place)
{
    int32_t frame = place->frame, reach = ath_footprint_reach[place->width] + 1;
    int32_t first = track->closed & 1 ? -1 : 1, last = track->closed & 2 ? track->frames : track->frames - 2;
    int32_t stop = last_frame(track, frame, reach - 1);
    place->is_weighed = 1;
    place->beyond = 0;
    place->curve = place->slope[0] = place->slope[1] = place->slope[2] = 0.0;
    for (int32_t t = first_frame(frame, reach - 1); t <= stop; t++) place->beyond += track->squares[t] > track->limit2;
    for (int32_t t = ath_max(first, frame - reach); t <= ath_min(last, frame + reach); t++) {
        double bend = footprint_bend(track, frame, place->width, t);
        for (int32_t k = 0; k < 3 && has_bend(track, t); k++) place->slope[k] += bend * track->bends[t][k];
        place->curve += bend * bend;
    }
}

/* Whether a closed end would cut off more of a footprint than its faint end. */
static int is_cut(int32_t frames, int32_t closed, int32_t frame, int32_t width)
{
    enum { FAINT = 5 };
    int32_t reach = ath_footprint_reach[width], behind = frames - frame;
    if (closed & 1 && frame + 1 <= reach && ath_footprint_part(width, frame + 1) > FAINT) return 1;
    return closed & 2 && behind <= reach && ath_footprint_part(width, behind) > FAINT;
}

static double more_bends(const track *track, const place *place, const int32_t q[3])
{
    double sum = 0.0, part = track->step / ATH_FOOTPRINT_PARTS;
    for (int32_t k = 0; k < 3; k++) {
        double x = q[k] * part;
        sum += x * (2.0 * place->slope[k] + x * place->curve);
    }
    return sum;
}

/* Returns the squared error of a frame with a candidate. */
static double square_with(const track *track, const candidate *tried, int32_t t)
{
    double error[3], part = ath_footprint_part(tried->own.width, t - tried->frame);
    for (int32_t k = 0; k < 3; k++) {
        int32_t q = tried->own.q[k];
        error[k] = q == 0 ? track->error[t][k] : error_with(track, t, k, q * part);
    }
    return square(error);
}

/* Fills the squared errors of the worst frame with all that may be tried at a place. */
static void open_place(const track *track, int32_t frame, int32_t width, place *place)
{
    int32_t t = track->worst;
    double part = ath_footprint_part(width, t - frame);
    place->frame = frame;
    place->width = width;
    place->is_weighed = 0;
    for (int32_t k = 0; k < 3; k++) {
        int32_t longest = length_of(place->whole[k]), sign = place->whole[k] < 0 ? -1 : 1;
        place->least[k] = place->still[k] = track->error[t][k] * track->error[t][k];
        for (int32_t i = 0; i < ath_min(SIZES, longest); i++) {
            double error = error_with(track, t, k, sign * (longest - i) * part);
            place->worst[k][i] = error * error;
            if (place->worst[k][i] < place->least[k]) place->least[k] = place->worst[k][i];
        }
    }
}

/* Whether some correction with these axes may bring the worst frame within the limit. */
static int may_fix_worst(const track *track, const place *place, int32_t mask)
{
    double squares[3];
    for (int32_t k = 0; k < 3; k++) squares[k] = mask >> k & 1 ? place->least[k] : place->still[k];
    return !(squares[0] + squares[1] + squares[2] > track->limit2);
}

/* Whether a correction brings the worst frame within the limit. */
static int fixes_worst(const track *track, const place *place, const int32_t q[3])
{
    double squares[3];
    for (int32_t k = 0; k < 3; k++)
        squares[k] = q[k] == 0 ? place->still[k] : place->worst[k][length_of(place->whole[k]) - length_of(q[k])];
    return !(squares[0] + squares[1] + squares[2] > track->limit2);
}

/* Returns whether a candidate costs less than `most`, brings the worst frame within the limit, and worsens no frame
 * beyond it. Fills the cost. */
static int try_candidate(const track *track, const ath_correction *above, place *place, double most, candidate *tried)
{
    int32_t at = place->frame, reach = ath_footprint_reach[place->width], fixed = 0;
    if (!fixes_worst(track, place, tried->own.q)) return 0;
    if (!place->is_weighed) weigh_place(track, place);
    double bits = estimated_bits(&tried->own, above + at) + track->bend_bits * more_bends(track, place, tried->own.q);
    if (bits >= most * (bits > 0.0 ? place->beyond : 1)) return 0;
    for (int32_t t = first_frame(at, reach); t <= last_frame(track, at, reach); t++) {
        double after = square_with(track, tried, t), before = track->squares[t];
        if (after > track->limit2 && after > before) return 0;
        fixed += before > track->limit2 && after <= track->limit2;
    }
    tried->cost = bits / fixed;
    return 1;
}

static int32_t to_steps(double value) { return value < 0.0 ? -(int32_t)(0.5 - value) : (int32_t)(value + 0.5); }

/* Finds the correction that removes most of an error with all its axes. Returns 0 if an axis would be 0. */
static int whole_correction(const double error[3], double scale, int32_t whole[3])
{
    for (int32_t k = 0; k < 3; k++) {
        double units = -error[k] / scale;
        if (!(units > -1e9 && units < 1e9)) return 0;
        whole[k] = to_steps(units);
        if (whole[k] == 0) whole[k] = units < 0.0 ? -1 : 1;
    }
    return 1;
}

/* Tries the axes of a mask: the whole correction, and up to two that are shorter by a step each. Returns 1 if one
 * serves. */
static int try_axes(const track *track, const ath_correction *above, place *place, int32_t mask, candidate *best)
{
    const int32_t *whole = place->whole;
    candidate tried = {place->frame, {{0, 0, 0}, place->width}, 0.0};
    int32_t longest = 0, found = 0;
    for (int32_t k = 0; k < 3; k++)
        if (mask >> k & 1) longest = ath_max(longest, length_of(whole[k]));
    for (int32_t size = longest; size > ath_max(0, longest - SIZES); size--) {
        for (int32_t k = 0; k < 3; k++)
            tried.own.q[k] = mask >> k & 1 ? to_steps((double)whole[k] * size / longest) : 0;
        if (!try_candidate(track, above, place, best->cost, &tried)) continue;
        found = 1;
        if (tried.cost < best->cost) *best = tried;
    }
    return found;
}

/* Finds the cheapest correction of a width in a frame for the worst frame, with few axes. Returns 0 if there is
 * none. */
static int try_frame(const track *track, const ath_correction *above, int32_t frame, int32_t width, candidate *best)
{
    static const int32_t masks[7] = {1, 2, 4, 3, 5, 6, 7}, stop_of[3] = {3, 6, 7}; /* by the number of axes */
    double scale = track->step * ath_footprint_part(width, track->worst - frame) / ATH_FOOTPRINT_PARTS;
    int32_t found = 0;
    place place;
    if (is_any(track->own + frame) || is_cut(track->frames, track->closed, frame, width)) return 0;
    if (!whole_correction(track->error[track->worst], scale, place.whole)) return 0;
    open_place(track, frame, width, &place);
    for (int32_t axes = 0, i = 0; axes < 3 && !found; axes++)
        for (; i < stop_of[axes]; i++)
            if (may_fix_worst(track, &place, masks[i])) found |= try_axes(track, above, &place, masks[i], best);
    return found;
}

static void apply(track *track, const candidate *chosen)
{
    int32_t at = chosen->frame, reach = ath_footprint_reach[chosen->own.width];
    track->own[at] = chosen->own;
    ath_add_correction(track->frames, at, &chosen->own, track->parts);
    for (int32_t t = first_frame(at, reach); t <= last_frame(track, at, reach); t++) {
        for (int32_t k = 0; k < 3; k++) track->error[t][k] = error_with(track, t, k, 0.0);
        track->squares[t] = square(track->error[t]);
    }
    bend_frames(track, at - reach - 1, at + reach + 1);
}

/* Adds corrections one by one for the frame that is worst then. Each leaves fewer frames beyond the limit. Returns 0 if
 * a frame cannot be brought within it. */
static int correct_track(track *track, const ath_correction *above, int32_t widest)
{
    if (track->worst >= 0) weigh_bends(track);
    for (; track->worst >= 0; find_worst(track)) {
        candidate best = {.cost = DBL_MAX};
        int found = 0;
        for (int32_t width = 0; width <= widest; width++) {
            int32_t reach = ath_footprint_reach[width], last = last_frame(track, track->worst, reach);
            for (int32_t t = first_frame(track->worst, reach); t <= last; t++)
                found |= try_frame(track, above, t, width, &best);
        }
        if (!found) return 0;
        apply(track, &best);
    }
    return 1;
}

/* Applies the corrections of a vertex that are decided already. */
static void decide(track *track, const ath_met_ends *ends, int64_t first, int64_t stop)
{
    for (int64_t i = first; i < stop; i++) {
        const int32_t *row = ends->decided + ATH_CORRECTION_ROW * i;
        candidate chosen = {.frame = row[1]};
        memcpy(&chosen.own, row + 2, sizeof chosen.own);
        apply(track, &chosen);
    }
    find_worst(track);
}

int64_t ath_find_corrections(int32_t vertex_count, int32_t frames, int is_float64, const void *positions,
                             const double *source, const double origin[3], const double *limits, const uint8_t *narrow,
                             double step, const ath_met_ends *ends, int32_t *corrections, int64_t capacity)
{
    track track = {.frames = frames, .is_float64 = is_float64, .step = step};
    ath_correction above[ATH_SEGMENT_FRAMES] = {{{0}, 0}};
    int64_t count = 0, decided = 0, next = 0;
    for (int32_t v = 0; v < vertex_count; v++, decided = next) {
        while (next < ends->count && ends->decided[ATH_CORRECTION_ROW * next] == v) next++;
        if (decided == next
            && is_within(frames, is_float64, positions, source, origin, limits[v], (size_t)v * 3 * (size_t)frames)) {
            memset(above, 0, (size_t)frames * sizeof above[0]);
            continue;
        }
        int32_t widest = narrow[v] ? 0 : ATH_FOOTPRINTS - 1; /* corrections of one frame cannot conflict */
        track.closed = ends->closed;
        for (int corrected = 0; !corrected; widest--) {
            if (widest < 0 && decided == next) return -1;
            if (widest < 0) {
                decided = next;
                widest = 0;
            }
            open_track(&track, v, positions, source, origin, limits[v]);
            decide(&track, ends, decided, next);
            corrected = correct_track(&track, above, widest);
        }
        for (int32_t t = 0; t < frames; t++) {
            if (!is_any(track.own + t)) continue;
            if (count < capacity) {
                int32_t *row = corrections + ATH_CORRECTION_ROW * count;
                row[0] = v;
                row[1] = t;
                memcpy(row + 2, track.own + t, sizeof track.own[t]);
            }
            count++;
        }
        memcpy(above, track.own, (size_t)frames * sizeof above[0]);
    }
    return count;
}

/* A part whose vertices are corrected together, so that it keeps its shape. */
typedef struct {
    int32_t first, count, frames, is_float64;
    const void *positions;
    const double *source, *origin, *limits;
    double step;
    double beyond[ATH_SEGMENT_FRAMES]; /* largest squared error over the squared limit; 0: the frame stays as it is */
    ath_corrected_parts middle;        /* middle of the vertices' errors before corrections */
    ath_corrected_parts parts;
    ath_correction own[ATH_SEGMENT_FRAMES]; /* all zero: none */
} rigid_part;

static void raise_to(double value, double *most)
{
    if (value > *most) *most = value;
}

ATH_HOT static void open_part(rigid_part *part)
{
    double least[3][ATH_SEGMENT_FRAMES], most[3][ATH_SEGMENT_FRAMES], squares[ATH_SEGMENT_FRAMES];
    int32_t frames = part->frames;
    memset(part->beyond, 0, (size_t)frames * sizeof part->beyond[0]);
    for (int32_t v = part->first; v < part->first + part->count; v++) {
        memset(squares, 0, (size_t)frames * sizeof *squares);
        for (size_t k = 0; k < 3; k++) {
            size_t row = ((size_t)v * 3 + k) * (size_t)frames;
            for (int32_t t = 0; t < frames; t++) {
                double decoded = ath_number_at(part->positions, row + (size_t)t, part->is_float64);
                double away = part->source[row + (size_t)t] + part->origin[k] - decoded;
                least[k][t] = v == part->first || away < least[k][t] ? away : least[k][t];
                most[k][t] = v == part->first || away > most[k][t] ? away : most[k][t];
                squares[t] += away * away;
            }
        }
        for (int32_t t = 0; t < frames; t++)
            raise_to(squares[t] / (part->limits[v] * part->limits[v]), part->beyond + t);
    }
    for (int32_t t = 0; t < frames; t++)
        for (int32_t k = 0; k < 3; k++) part->middle[t][k] = 0.5 * (least[k][t] + most[k][t]);
    memset(part->parts, 0, (size_t)frames * sizeof part->parts[0]);
    memset(part->own, 0, (size_t)frames * sizeof part->own[0]);
}

/* Returns `beyond` in a frame with `more` of a further correction. */
static double beyond_with(const rigid_part *part, int32_t t, const int32_t q[3], int32_t more)
{
    double most = 0.0;
    for (int32_t v = part->first; v < part->first + part->count; v++) {
        double error[3];
        for (int32_t k = 0; k < 3; k++) {
            size_t at = ((size_t)v * 3 + (size_t)k) * (size_t)part->frames + (size_t)t;
            double sum = ath_number_at(part->positions, at, part->is_float64);
            double parts = part->parts[t][k] + (double)q[k] * more;
            if (parts != 0.0) sum = ath_corrected(sum, parts, part->step);
            error[k] = (part->is_float64 ? sum : ath_single(sum)) - (part->source[at] + part->origin[k]);
        }
        raise_to(square(error) / (part->limits[v] * part->limits[v]), &most);
    }
    return most;
}

/* Moves a part by the middle of its vertices' errors in a frame, if that brings all of them within their limits and
 * worsens no frame around. Returns whether it does. */
static int move_part(rigid_part *part, int32_t closed, int32_t frame, int32_t width)
{
    ath_correction own = {{0, 0, 0}, width};
    double after[2 * ATH_FOOTPRINT_REACH + 1];
    int32_t reach = ath_footprint_reach[width];
    int32_t start = first_frame(frame, reach), stop = ath_min(part->frames - 1, frame + reach);
    for (int32_t k = 0; k < 3; k++) {
        double units = part->middle[frame][k] / part->step - part->parts[frame][k] / ATH_FOOTPRINT_PARTS;
        own.q[k] = units > -1e9 && units < 1e9 ? to_steps(units) : 0;
    }
    if (!is_any(&own) || is_any(part->own + frame) || is_cut(part->frames, closed, frame, width)) return 0;
    for (int32_t t = start; t <= stop; t++) {
        after[t - start] = beyond_with(part, t, own.q, ath_footprint_part(width, t - frame));
        if (after[t - start] > 1.0 && (t == frame || after[t - start] > part->beyond[t])) return 0;
    }
    memcpy(part->beyond + start, after, (size_t)(stop - start + 1) * sizeof after[0]);
    part->own[frame] = own;
    ath_add_correction(part->frames, frame, &own, part->parts);
    return 1;
}

/* Returns the frame farthest beyond a limit; -1: none. */
static int32_t worst_of(const rigid_part *part)
{
    int32_t worst = -1;
    double most = 1.0;
    for (int32_t t = 0; t < part->frames; t++)
        if (part->beyond[t] > most) {
            most = part->beyond[t];
            worst = t;
        }
    return worst;
}

/* Corrects frame by frame, each over as many frames as possible, since a part that moves in a single frame pops. */
static void correct_part(rigid_part *part, int32_t closed, int32_t widest)
{
    for (int32_t t = worst_of(part); t >= 0; t = worst_of(part)) {
        int32_t width = widest;
        while (width >= 0 && !move_part(part, closed, t, width)) width--;
        if (width < 0) part->beyond[t] = 0.0;
    }
}

int64_t ath_find_rigid_corrections(int32_t part_count, const int32_t *first, const int32_t *counts, int32_t frames,
                                   int is_float64, const void *positions, const double *source, const double origin[3],
                                   const double *limits, int is_narrow, double step, int32_t closed,
                                   int32_t *corrections, int64_t capacity)
{
    rigid_part part = {.frames = frames, .is_float64 = is_float64, .positions = positions, .source = source};
    int64_t count = 0;
    part.origin = origin;
    part.limits = limits;
    part.step = step;
    for (int32_t p = 0; p < part_count; p++) {
        part.first = first[p];
        part.count = counts[p];
        open_part(&part);
        correct_part(&part, closed, is_narrow ? 0 : ATH_FOOTPRINTS - 1);
        for (int32_t t = 0; t < frames; t++)
            for (int32_t v = first[p]; v < first[p] + counts[p] && is_any(part.own + t); v++, count++) {
                if (count >= capacity) continue;
                int32_t *row = corrections + ATH_CORRECTION_ROW * count;
                row[0] = v;
                row[1] = t;
                memcpy(row + 2, part.own + t, sizeof part.own[t]);
            }
    }
    return count;
}

static void apply_to_vertex(int32_t frames, int is_float64, void *positions, size_t first, const double parts[][3],
                            double step)
{
    for (size_t k = 0; k < 3; k++)
        for (size_t t = 0; t < (size_t)frames; t++) {
            size_t at = first + k * (size_t)frames + t;
            if (parts[t][k] == 0.0) continue;
            double sum = ath_corrected(ath_number_at(positions, at, is_float64), parts[t][k], step);
            ath_put_number(positions, at, is_float64, sum);
        }
}

void ath_apply_corrections(int32_t frames, int is_float64, void *positions, double step, const int32_t *corrections,
                           int64_t count)
{
    ath_corrected_parts parts;
    for (const int32_t *row = corrections, *stop = row + ATH_CORRECTION_ROW * count; row < stop;) {
        int32_t v = row[0];
        memset(parts, 0, (size_t)frames * sizeof parts[0]);
        for (; row < stop && row[0] == v; row += ATH_CORRECTION_ROW) {
            ath_correction own;
            memcpy(&own, row + 2, sizeof own);
            ath_add_correction(frames, row[1], &own, parts);
        }
        apply_to_vertex(frames, is_float64, positions, (size_t)v * 3 * (size_t)frames, parts, step);
    }
}
