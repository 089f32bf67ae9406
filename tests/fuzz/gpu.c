/* Fuzz target: the GPU form of every level, and of segments at each, of a file whose checksums fit. Blocks keep to the
 * memory that they asked for, are functions of the file's bytes, and name nothing outside of themselves: what a shader reads
 * on their word is there. */
#include "harness.h"

#include "ath_gpu.h"

enum { MOST_MEMORY = 8 << 20, MOST_SEGMENTS = 4, SET = ATH_GPU_WIDE - 1 };

static const uint32_t *words_of(const void *block, uint32_t at) { return (const uint32_t *)block + at; }

static int is_within(uint64_t at, uint64_t count, uint64_t words) { return at + count <= words; }

/* ---- levels ---- */

static void check_body(const ath_gpu_level *head, const ath_gpu_body *bodies, uint32_t b)
{
    const ath_gpu_body *own = bodies + b, *parent = bodies + own->parent;
    int is_node = own->flags & ATH_GPU_NODE;
    uint64_t bases = head->words - head->bases, rows = is_node ? 3 : (uint64_t)own->count;
    REQUIRE(own->parent < (int32_t)b && (own->parent < 0) == (own->attach < 0), "bodies hang on bodies before them");
    REQUIRE(is_within((uint64_t)own->first, is_node ? 1 : rows, is_node ? head->matrix_count : head->position_count),
            "a body places what there is");
    REQUIRE(own->vertex >= 0 && is_within((uint64_t)own->vertex, is_node ? 1 : rows, head->vertex_count),
            "a body is of vertices");
    REQUIRE(own->modes <= 64 && own->shape_modes <= 64 && is_within(own->basis, own->modes * rows, bases),
            "a basis is in the block");
    if (own->parent < 0) return;
    REQUIRE(own->attach >= parent->first && own->attach < parent->first + parent->count, "it hangs on its parent");
    if (own->flags & ATH_GPU_FOLLOWS) REQUIRE(is_within(own->way, parent->modes, bases), "ways are in the block");
}

static void check_level(const ath_gpu_level *head, size_t size)
{
    const ath_gpu_body *bodies = (const ath_gpu_body *)(const void *)words_of(head, head->bodies);
    const ath_gpu_vertex *vertices = (const ath_gpu_vertex *)(const void *)words_of(head, head->vertices);
    const uint32_t *order = words_of(head, head->order), *depths = words_of(head, head->depths);
    REQUIRE(head->words <= size / 4 && head->bases <= head->words, "a block keeps to its memory");
    REQUIRE(depths[0] == 0 && depths[head->depth_count] == head->body_count, "depths hold every body");
    for (uint32_t d = 0; d < head->depth_count; d++)
        for (uint32_t i = depths[d]; i < depths[d + 1]; i++) REQUIRE(order[i] < head->body_count, "bodies are ordered");
    for (uint32_t b = 0; b < head->body_count; b++) check_body(head, bodies, b);
    for (uint32_t v = 0; v < head->vertex_count; v++) {
        uint32_t moved = vertices[v].binding & ATH_GPU_MOVED, index = vertices[v].binding & ~ATH_GPU_MOVED;
        REQUIRE(index < (moved ? head->matrix_count : head->position_count), "a vertex is bound to what is placed");
    }
}

static ath_gpu_level *build_level(fuzz_file *opened, int32_t level, int fill)
{
    if (!fuzz_refine(opened, level, MOST_MEMORY, fill)) return NULL;
    size_t size = ath_gpu_level_size(opened->file, level);
    if (size > MOST_MEMORY) return NULL;
    ath_gpu_level *block = fuzz_memory(size, fill);
    REQUIRE(ath_gpu_build_level(opened->file, level, block, size - 1) == ATH_NO_MEMORY, "too little is seen");
    REQUIRE(ath_gpu_build_level(opened->file, level, block, size) == ATH_OK, "a level takes the size it asked for");
    check_level(block, size);
    return block;
}

/* ---- segments ---- */

static void check_row(const ath_gpu_segment *head, const ath_gpu_body *body, const ath_gpu_row *row)
{
    uint32_t set = row->waves & SET, values = 3u * row->count;
    if (!(row->waves & ATH_GPU_WIDE)) values = (values + 1) / 2;
    REQUIRE(is_within(row->values, values, head->shapes - head->values), "values are in the block");
    REQUIRE(set < ATH_GPU_WAVE_SETS && head->wave_sets[set] > 0
                && is_within(head->wave_sets[set], (uint64_t)row->count * head->frames, head->words),
            "waves are in the block");
    REQUIRE(row->slot < body->modes || row->slot == ATH_GPU_SHIFT || row->slot == ATH_GPU_ROTATION,
            "a row moves a mode of its body");
}

static void check_move(const ath_gpu_segment *head, const ath_gpu_body *body, const ath_gpu_move *move)
{
    const ath_gpu_row *rows = (const ath_gpu_row *)(const void *)words_of(head, head->rows);
    uint32_t count = move->counts & 0xffff, shapes = move->counts >> 16;
    REQUIRE(is_within(move->row, count, head->row_count), "rows are in the block");
    REQUIRE(is_within(move->shapes, 3 * (uint64_t)shapes * body->shape_modes, head->turns - head->shapes),
            "shapes are in the block");
    for (uint32_t i = 0; i < count; i++) {
        check_row(head, body, rows + move->row + i);
        if (rows[move->row + i].slot == ATH_GPU_ROTATION)
            REQUIRE(is_within(move->turn, 9, head->join_curve - head->turns), "turns are in the block");
    }
}

static void check_corrections(const ath_gpu_level *level, const ath_gpu_segment *head)
{
    const ath_gpu_correction *corrections = (const ath_gpu_correction *)(const void *)words_of(head, head->corrections);
    const uint32_t *at = words_of(head, head->corrected);
    for (uint32_t i = 0; i < head->corrected_count; i++, at += 2) {
        REQUIRE(at[0] < level->position_count && at[1] < at[3], "a correction is of a position");
        REQUIRE(is_within(head->corrections, 2 * (uint64_t)at[3], head->words), "corrections are in the block");
        for (uint32_t c = at[1]; c < at[3]; c++) REQUIRE(corrections[c].frame < head->frames, "it is of a frame");
    }
}

static void check_segment(const ath_gpu_level *level, const ath_gpu_segment *head, size_t size)
{
    const ath_gpu_body *bodies = (const ath_gpu_body *)(const void *)words_of(level, level->bodies);
    const ath_gpu_move *moves = (const ath_gpu_move *)(const void *)words_of(head, head->moves);
    REQUIRE(head->words <= size / 4 && head->level == level->level, "a block keeps to its memory");
    if (head->baked) {
        REQUIRE(is_within(head->baked, 3 * (uint64_t)head->frames * level->position_count, head->words),
                "baked positions are in the block");
        return;
    }
    REQUIRE(head->rows - head->moves == 4 * level->body_count, "every body is moved");
    for (uint32_t b = 0; b < level->body_count; b++) check_move(head, bodies + b, moves + b);
    if (head->join_frames > 0)
        REQUIRE(head->joins - head->join_steps == 2 * level->body_count
                    && head->matrix_joins - head->joins == 3 * level->position_count
                    && head->corrected - head->matrix_joins == 24 * level->matrix_count,
                "every number is joined");
    check_corrections(level, head);
}

/* A segment that is prepared and recorded; null where it is refused or too large. *recorded, to be freed, holds the block. */
static ath_segment *record(const ath_file *file, int32_t segment, int32_t level, ath_gpu_room *room, int fill,
                           void **recorded, const ath_gpu_segment **block)
{
    size_t work_size = ath_work_size(file), size = ath_segment_size(file, level);
    size_t room_size = ath_gpu_record_size(file, level, room);
    if (work_size > MOST_MEMORY || size > MOST_MEMORY || room_size > 4 * MOST_MEMORY) return NULL;
    void *work = fuzz_memory(work_size, fill), *memory = fuzz_memory(size, fill);
    *recorded = fuzz_memory(room_size, fill);
    int result = ath_prepare_start(work, work_size, file, segment, level, memory, size);
    if (result == ATH_OK) {
        REQUIRE(ath_gpu_record((ath_work *)work, room, *recorded, room_size - 1) == ATH_NO_MEMORY,
                "too little is seen");
        REQUIRE(ath_gpu_record((ath_work *)work, room, *recorded, room_size) == ATH_OK, "recording takes its size");
        result = ath_prepare_step((ath_work *)work, INT32_MAX);
    }
    free(work);
    if (result == ATH_OK) {
        *block = ath_gpu_recorded(*recorded, room);
        return memory;
    }
    free(memory);
    free(*recorded);
    *recorded = NULL;
    return NULL;
}

static void check_box(const ath_file *file, const ath_segment *segment)
{
    float box[6];
    ath_gpu_bounds(file, segment, box);
    for (int32_t k = 0; k < 3; k++) REQUIRE(!(box[k] > box[3 + k]), "a box is no less than empty");
    for (int32_t t = ath_segment_start(file, segment->index); t < ath_segment_start(file, segment->index + 1); t++)
        REQUIRE(ath_gpu_frame(file, t) >= 0 && ath_gpu_frame(file, t) < segment->frames, "a frame is coded");
}

/* Without room, with what that says is needed, and with more over other memory. */
static void record_segment(const ath_file *file, const ath_gpu_level *level, int32_t segment, const uint8_t *options)
{
    void *none, *exact, *ample;
    const ath_gpu_segment *first, *second, *third;
    int32_t at = (int32_t)level->level;
    ath_gpu_room room = {0, 0, 0, 0, 0, 0, 0}, more;
    ath_segment *prepared = record(file, segment, at, &room, options[1], &none, &first);
    if (!prepared) return;
    check_box(file, prepared);
    more = room;
    ath_segment *again = record(file, segment, at, &room, 0xa5, &exact, &second);
    if (again) {
        REQUIRE(second && memcmp(&more, &room, sizeof room) == 0, "needed room suffices, and stays what is needed");
        if (first) REQUIRE(memcmp(first, second, 4 * (size_t)first->words) == 0, "blocks do not depend on room");
        check_segment(level, second, ath_gpu_record_size(file, at, &room));
        more.values += options[2];
        more.corrections += options[3];
        ath_segment *last = record(file, segment, at, &more, 0x5a, &ample, &third);
        REQUIRE(last && third && memcmp(second, third, 4 * (size_t)second->words) == 0, "blocks do not depend on room");
        free(last);
        free(ample);
        free(exact);
    }
    free(again);
    free(prepared);
    free(none);
}

static void use(fuzz_file *opened, const uint8_t *options)
{
    ath_info info;
    ath_get_info(opened->file, &info);
    for (int32_t level = 0; level < info.level_count; level++) {
        ath_gpu_level *block = build_level(opened, level, options[0]), *same = build_level(opened, level, 0xa5);
        if (block && same) {
            REQUIRE(memcmp(block, same, 4 * (size_t)block->bodies) == 0, "a level is a function of the file's bytes");
            for (int32_t s = 0; s < ath_min(info.segment_count, MOST_SEGMENTS); s++)
                record_segment(opened->file, block, s, options);
        }
        free(block);
        free(same);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < OPTIONS) return 0;
    ath_limits limits = fuzz_limits(2 << 20);
    fuzz_file opened;
    uint8_t *file = fuzz_copy(data, size - OPTIONS);
    fuzz_repair(file, size - OPTIONS);
    if (fuzz_open(&opened, file, size - OPTIONS, &limits, 0xa5)) {
        ath_feed(opened.file, file, 0, size - OPTIONS);
        use(&opened, data + size - OPTIONS);
        fuzz_close(&opened);
    }
    free(file);
    return 0;
}
