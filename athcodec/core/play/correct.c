/* Corrections of a piece that is placed, and the exact numbers of its vertices. */
#include "play/correct.h"

static void correct(ath_segment *segment, size_t at, double parts, double step)
{
    if (parts == 0.0) return;
    double position = ath_number_at(segment->positions, at, segment->is_float64);
    ath_put_number(segment->positions, at, segment->is_float64, ath_corrected(position, parts, step));
}

static void correct_vertex(const corrections_reader *reader, const correction_row *row, ath_segment *segment,
                           size_t position)
{
    ath_corrected_parts parts;
    correction_parts(row, segment->frames, parts);
    for (int32_t from = 0; from < segment->frames; from += CORRECTION_BLOCK)
        for (int32_t t = from; is_reached(row, from) && t < ath_min(from + CORRECTION_BLOCK, segment->frames); t++)
            for (size_t k = 0; k < 3; k++)
                correct(segment, ((size_t)t * (size_t)segment->exact_vertices + position) * 3 + k, parts[t][k],
                        reader->step);
}

static void watch_corrections(const ath_work *work, const correction_row *row, int32_t position)
{
    ath_watcher *watcher = ath_watcher_of(work);
    for (int32_t t = 0; t < work->segment->frames; t++)
        if (has_correction(row, t)) watcher->correction(watcher, position, t, row->of + t, work->corrections.step);
}

void ath_correct_piece(ath_work *work, const ath_piece *piece)
{
    corrections_reader *reader = &work->corrections;
    ath_coder coder = reader->coder;
    size_t position = ath_position_of_piece(work);
    for (int32_t i = 0; i < piece->count; i++) {
        const correction_row *row = code_vertex(&coder, reader->model, work->segment->frames, 0);
        if (!row || work->is_predicted) continue;
        correct_vertex(reader, row, work->segment, position + (size_t)i);
        if (ath_watcher_of(work)) watch_corrections(work, row, work->exact + i);
    }
    reader->coder = coder;
}

static int read_exact_point(ath_work *work, size_t at)
{
    exact_reader *reader = &work->exact_level;
    double known[3], number[3];
    for (size_t k = 0; k < 3; k++)
        known[k] = ath_number_at(work->segment->positions, at + k, work->segment->is_float64);
    if (!code_exact_point(&reader->coder, reader->model, work->segment->is_float64, known, reader->length, number))
        return 0;
    for (size_t k = 0; k < 3; k++)
        ath_put_number(work->segment->positions, at + k, work->segment->is_float64, number[k]);
    return 1;
}

/* Replaces the positions of the last lossy stage by the source's own. */
int ath_make_exact(ath_work *work, const ath_piece *piece)
{
    size_t vertices = (size_t)work->segment->exact_vertices, position = ath_position_of_piece(work);
    for (int32_t i = 0; i < piece->count; i++)
        for (size_t t = 0; t < (size_t)work->segment->frames; t++)
            if (!read_exact_point(work, (t * vertices + position + (size_t)i) * 3))
                return ath_blame(work, work->exact_level.chunk, ATH_BAD_CHUNK);
    return ATH_OK;
}
