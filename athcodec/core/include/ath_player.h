/* athcodec: plays an .ath file that is in memory. This optional header on top of ath.h allocates memory, caches
 * prepared segments, and prepares them in slices, so that no call takes long.
 *
 *     #define ATH_PLAYER_IMPLEMENTATION      in one C or C++ file, before the include
 *     #include "ath_player.h"
 *
 *     ath_player_open, ath_player_close      open all of a file or a prefix of it, at once or in slices
 *     ath_player_feed                        hand over ranges of it that have arrived since
 *     ath_player_positions, _matrices        get what to draw of a clip at a time and level
 *     ath_player_faded_positions             do the same during a fade from level to level
 *     ath_player_blended_positions           blend several clips by weights
 *     ath_player_wind_positions              blend several clips by the wind
 *     ath_player_show                        get the segments of a moment, for any other function of ath.h
 *     ath_player_set_budget                  choose between short calls and exact levels
 *     ath_player_ahead                       prepare the next segment, a bounded piece of work per drawn frame
 *     ath_player_begin, _run, _end           prepare segments as jobs of your own job system, on any thread
 *     ath_player_triangles, _lines           get the topology
 *     ath_player_normals, _tangents          compute what shading needs
 *     ath_player_bounds                      compute what culling needs
 *
 * Memory comes from malloc or from your functions. Leave the bytes of the file in place until you close the player. To
 * decide yourself what is in memory, use ath.h.
 *
 * Time. A call that shows something builds levels and prepares segments for its budget, about 2 ms, and at most one step
 * of ath.h more. Opening takes longer, unless you choose options.in_slices.
 * Until the level that you ask for is prepared, it shows the best level that is: a deeper one, else a coarser one. A
 * coarse level of the next segment is prepared first, in case the budget does not suffice for the one that you ask for.
 * If nothing is prepared, level 0 is, at once, or the coarsest one whose bytes have been fed. If the level is prepared
 * for only one of two frames, that one is held.
 *
 * Threads. Use a player from one thread at a time. Only ath_player_run may run on other threads meanwhile, each job on
 * one. Hand the job over and back by a queue of yours.
 *
 * Results are those of ath.h; ath_player_fault tells more. C11 or C++17. */
#ifndef ATH_PLAYER_H
#define ATH_PLAYER_H

#include "ath.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct ath_player ath_player;
typedef struct ath_player_job ath_player_job; /* the preparation of one segment */

/* Options; zeros are the defaults. */
typedef struct ath_player_options {
    void *(*allocate)(void *context, size_t size); /* returns memory aligned to 16, or null. Null: malloc */
    void (*release)(void *context, void *memory);  /* frees memory of `allocate`; null: nothing is freed */
    void *context;
    size_t cache_bytes;       /* memory of prepared segments, beyond those shown; 0: 64 MiB */
    const ath_limits *limits; /* null: see ath_default_limits */
    const void *host_mesh;    /* see ath_set_host_mesh; null: none */
    size_t host_stride;
    int32_t host_vertex_count;
    int32_t in_slices; /* 1: ath_player_open only begins to open the file, and ath_player_ahead goes on with it */
} ath_player_options;

/* Opens a file, of which `size` bytes are there: at least its prelude. options, fault: may be null. If it fails,
 * *player is null, and the result is an error of the file, ATH_MISSING, ATH_NO_MEMORY, ATH_NEEDS_HOST_MESH or
 * ATH_WRONG_HOST_MESH. With options->in_slices it returns ATH_MORE: leave the mesh in place, and call nothing but
 * ath_player_ahead and ath_player_close, until ath_player_ahead no longer returns ATH_MORE; it may return these errors,
 * too. */
int ath_player_open(ath_player **player, const uint8_t *bytes, size_t size, const ath_player_options *options,
                    ath_fault_info *fault);
/* Closes a player, which may be null. End its jobs before. */
void ath_player_close(ath_player *player);
/* Hands over `size` bytes of the file from `offset` on, such as a range that ath_ranges names, as ath_feed does; they
 * have to stay in place, too. Levels whose bytes have arrived are shown from the next call on. End all jobs before. */
void ath_player_feed(ath_player *player, const uint8_t *bytes, uint64_t offset, size_t size);
/* Returns the file, for ath_get_info, ath_clips, ath_level_for, ath_cut and all functions that take a const file. */
const ath_file *ath_player_file(const ath_player *player);
/* Returns the fault behind the last error. */
const ath_fault_info *ath_player_fault(const ath_player *player);

/* Budgets in the unit of ath_prepare_within, vertex-frames. */
enum { ATH_PLAYER_BUDGET = 150000, ATH_PLAYER_EXACT = 0x7fffffff };

/* Sets what each later call that shows something may spend, at first ATH_PLAYER_BUDGET. With 0, jobs alone prepare the
 * levels above 0. With ATH_PLAYER_EXACT, as for offline rendering, each call waits for the level that it asks for. */
void ath_player_set_budget(ath_player *player, int32_t vertex_frames);
/* Returns the vertex-frames that all calls of this player except ath_player_run have prepared so far. */
uint64_t ath_player_prepared(const ath_player *player);

/* The segments that show a moment, all at one level. They last until the next call that shows something. */
typedef struct ath_player_moment {
    double frame; /* pass it to ath_positions, ath_matrices and the like */
    int32_t level, segment_count;
    const ath_segment *segments[2];
} ath_player_moment;

/* Gets the segments that show a clip at a time in seconds since its first frame, and prepares those that are not ready,
 * as far as the budget goes. moment->level is the level that is shown. level: -1 for the deepest. If bytes of the level
 * are missing, the deepest level that is there replaces it. Returns ATH_OK, ATH_MISSING: not even level 0 is there,
 * ATH_BAD_CHECKSUM, ATH_BAD_CHUNK, ATH_BAD_ARGUMENT: there is no such clip, or ATH_NO_MEMORY. */
int ath_player_show(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, int32_t level,
                    ath_player_moment *moment);
/* Calls ath_player_show and then ath_positions, which returns ATH_HELD for a frame without its blend. */
int ath_player_positions(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, int32_t level,
                         ath_order order, float *xyz, size_t stride);
/* Calls ath_player_show, though never for a deeper level, and then ath_matrices and ath_exact, of 12 and 3 floats
 * without gaps. `matrices` and `exact` need room for the largest counts that ath_cut_size gives for levels up to
 * `level`. *shown is the level whose ath_cut they belong to; `shown` may be null. */
int ath_player_matrices(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, int32_t level, float *matrices,
                        float *exact, int32_t *shown);
/* Calls ath_faded_positions for all levels of a fade. Pass to ath_fade_to the level that ath_player_show gives: the best
 * level that is prepared replaces one that is not. */
int ath_player_faded_positions(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, const ath_fade *fade,
                               ath_order order, float *xyz, size_t stride);

/* One clip of a blend, at its own time and level, with a weight as in ath_share. */
typedef struct ath_player_share {
    int32_t clip, level;
    ath_wrap wrap;
    double seconds, weight;
} ath_player_share;

/* Calls ath_blended_positions for clips, up to ATH_BLEND_CLIPS of which have a weight. Only these are prepared, now and
 * ahead. Scratch memory lasts until the player is closed. Returns codes of ath_player_show and
 * ath_blended_positions. */
int ath_player_blended_positions(ath_player *player, const ath_player_share *shares, int32_t share_count,
                                 ath_order order, float *xyz, size_t stride);
/* Blends the clips that ath_wind_weights chooses for a wind, all at one time. winds: one for each clip of the file. */
int ath_player_wind_positions(ath_player *player, const ath_wind *winds, double strength, double heading,
                              double seconds, ath_wrap wrap, int32_t level, ath_order order, float *xyz, size_t stride);

/* Prepares what was asked for last and then what comes after it, in its direction and with its wrap, for a budget.
 * Returns ATH_MORE; ATH_OK: nothing is left to do until time goes on; or an error. */
int ath_player_ahead(ath_player *player, int32_t vertex_frames);

/* Returns the first of these preparations as a job. Null: nothing is left to do, there is no memory, or its level is
 * still being built, by ATH_PLAYER_BUDGET with each call. */
ath_player_job *ath_player_begin(ath_player *player);
/* Runs a job for a budget, on any thread. Returns ATH_MORE until it is done. */
int ath_player_run(ath_player_job *job, int32_t vertex_frames);
/* Takes over the segment of a job, if that is done, and frees the job. */
void ath_player_end(ath_player *player, ath_player_job *job);

/* Writes the triangles of the faces, three vertices each, numbered in file or source order. Faces of more corners
 * become fans. *count is the number of triangles; `triangles` may be null. Returns the codes of ath_read_polygons;
 * ATH_BAD_ARGUMENT: the file has no faces. */
int ath_player_triangles(ath_player *player, ath_order order, uint32_t *triangles, size_t *count);
/* Writes the edges, two vertices each: those of the source, or else those along its stems. */
int ath_player_lines(ath_player *player, ath_order order, uint32_t *lines, size_t *count);

/* Computes the normals of vertices: those of the triangles around each, weighted by area; zeros for vertices without
 * triangles. xyz: positions of three floats, `stride` bytes apart; normals: three floats each, without gaps. */
void ath_player_normals(const uint32_t *triangles, size_t count, const float *xyz, size_t stride, int32_t vertex_count,
                        float *normals);
/* Computes the box of positions, least x, y, z and then largest x, y, z. It holds for what is shown now: compute it for
 * each frame, or join the boxes of levels and times. vertex_count: 1 or more. */
void ath_player_bounds(const float *xyz, size_t stride, int32_t vertex_count, float *box);
/* Computes the tangents, along which u grows, at right angles to the normals. Each has four floats as in glTF: the
 * fourth, 1 or -1, times the cross product of normal and tangent is the bitangent. Vertices without triangles get
 * zeros. uv: two floats per vertex, `uv_stride` bytes apart. */
void ath_player_tangents(const uint32_t *triangles, size_t count, const float *xyz, size_t stride, const float *uv,
                         size_t uv_stride, const float *normals, int32_t vertex_count, float *tangents);

#ifdef __cplusplus
}
#endif
#endif

#ifdef ATH_PLAYER_IMPLEMENTATION
#ifndef ATH_PLAYER_IMPLEMENTED
#define ATH_PLAYER_IMPLEMENTED

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A segment that is prepared, or that a job prepares. Its memory stands behind the entry. */
typedef struct ath_player_entry {
    struct ath_player_entry *next;
    size_t size;
    uint64_t used; /* the call that showed it last */
    int32_t segment, level;
} ath_player_entry;

struct ath_player_job {
    ath_player_job *next;
    ath_player_entry *entry;
    ath_work *work;
    int result;
};

/* Memory that lasts as long as the player. */
typedef struct ath_player_block {
    struct ath_player_block *next;
} ath_player_block;

/* A clip that is shown; what is prepared ahead follows from it. */
typedef struct ath_player_track {
    int32_t clip, segment, level, direction;
    double frame;
    ath_wrap wrap;
} ath_player_track;

struct ath_player {
    ath_player_options options;
    ath_file *file;
    ath_info info;
    ath_fault_info fault;
    ath_player_block *blocks;
    ath_player_entry *entries;
    ath_player_job *jobs, *idle; /* running jobs; jobs whose work memory waits for the next segment */
    ath_player_job *own;         /* the job that the player's thread runs, one of `jobs` */
    size_t cached;
    uint64_t calls, prepared;
    int32_t budget, left; /* of each call, and what is left of it in this one */
    int32_t dropped;      /* jobs that were dropped for others since one was done */
    int32_t deepest;      /* deepest level of the file */
    int32_t built;        /* deepest level whose bases are built; -1 until the file is open */
    size_t *sizes;        /* bytes of a segment at each level */
    int32_t refused;      /* the error that keeps a level from being built, else ATH_OK */
    int32_t track_count;
    ath_player_track tracks[ATH_BLEND_CLIPS];
    void *blending;  /* scratch memory of blends; null: no blend was shown */
    double *weights; /* by the wind, one per clip */
};

/* Number of jobs in a row that are dropped for another segment before one is finished, so that a player that shows
 * several moments in turn gets on with one of them. */
enum { ATH_PLAYER_DROPS = 8 };

enum { ATH_PLAYER_HEAD = 64 }; /* bytes in front of aligned memory, which hold any of the structs above */

/* Aligns memory of malloc to 64 and puts malloc's pointer in front of it. */
static void *ath_player_aligned(size_t size)
{
    const size_t extra = 64 + sizeof(void *);
    char *memory = size <= SIZE_MAX - extra ? (char *)malloc(size + extra) : NULL;
    if (!memory) return NULL;
    char *aligned = memory + extra - (uintptr_t)(memory + extra) % 64;
    memcpy(aligned - sizeof(void *), &memory, sizeof memory);
    return aligned;
}

static void *ath_player_take(const ath_player_options *options, size_t size)
{
    if (options->allocate) return options->allocate(options->context, size > 0 ? size : 1);
    return ath_player_aligned(size);
}

static void ath_player_give(const ath_player_options *options, void *memory)
{
    void *given;
    if (!memory) return;
    if (options->allocate) {
        if (options->release) options->release(options->context, memory);
        return;
    }
    memcpy(&given, (char *)memory - sizeof(void *), sizeof given);
    free(given);
}

static void *ath_player_block_of(ath_player *p, size_t size)
{
    char *memory = (char *)ath_player_take(&p->options, ATH_PLAYER_HEAD + size);
    if (!memory) return NULL;
    ath_player_block *block = (ath_player_block *)memory;
    block->next = p->blocks;
    p->blocks = block;
    return memory + ATH_PLAYER_HEAD;
}

static void *ath_player_memory_of(ath_player_entry *entry) { return (char *)entry + ATH_PLAYER_HEAD; }

/* ---- opening ---- */

/* Builds what the segments share up to a level, for a budget. Jobs, which prepare levels that are built, do not look at
 * what this changes. */
static int ath_player_refine(ath_player *p, int32_t level, int32_t *budget)
{
    while (p->built < level) {
        int32_t left = *budget;
        size_t size;
        if (p->refused != ATH_OK) return p->refused;
        if (left <= 0) return ATH_MORE;
        int result = ath_refine_size_within(p->file, p->built + 1, &size, &left, &p->fault);
        void *memory = size > 0 ? ath_player_block_of(p, size) : NULL;
        if (size > 0 && !memory) return ATH_NO_MEMORY;
        if (result != ATH_OK && result != ATH_MORE) return p->refused = result;
        if (result == ATH_OK) result = ath_refine_within(p->file, p->built + 1, memory, size, &left);
        p->prepared += (uint64_t)((int64_t)*budget - left);
        if (*budget != ATH_PLAYER_EXACT) *budget = left;
        if (result == ATH_OK) p->built++;
    }
    return ATH_OK;
}

/* Goes on with opening for a budget, and then builds level 0. */
static int ath_player_build(ath_player *p, int32_t *budget)
{
    const ath_player_options *own = &p->options;
    int32_t before = *budget;
    int result = p->sizes ? ATH_OK : ath_open_within(p->file, before != ATH_PLAYER_EXACT ? budget : NULL, &p->fault);
    p->prepared += (uint64_t)((int64_t)before - *budget);
    if (result == ATH_OK && !p->sizes) {
        ath_get_info(p->file, &p->info);
        p->deepest = p->info.level_count - 1;
        if (p->info.rest_is_host && own->host_mesh)
            result = ath_set_host_mesh(p->file, own->host_mesh, own->host_stride, own->host_vertex_count, &p->fault);
        if (result != ATH_OK) return result;
        p->sizes = (size_t *)ath_player_block_of(p, (size_t)p->info.level_count * sizeof *p->sizes);
        if (!p->sizes) return ATH_NO_MEMORY;
        for (int32_t level = 0; level <= p->deepest; level++) p->sizes[level] = ath_segment_size(p->file, level);
    }
    return result == ATH_OK ? ath_player_refine(p, 0, budget) : result;
}

int ath_player_open(ath_player **player, const uint8_t *bytes, size_t size, const ath_player_options *options,
                    ath_fault_info *fault)
{
    ath_player_options own;
    ath_fault_info why;
    size_t front, file_size;
    int32_t exactly = ATH_PLAYER_EXACT;
    memset(&own, 0, sizeof own);
    if (options) own = *options;
    if (own.cache_bytes == 0) own.cache_bytes = (size_t)64 << 20;
    *player = NULL;
    int result = ath_front(bytes, size, own.limits, &front, &file_size, &why);
    if (fault) *fault = why;
    if (result != ATH_OK) return result;
    ath_player *p = (ath_player *)ath_player_take(&own, sizeof *p);
    if (!p) return ATH_NO_MEMORY;
    memset(p, 0, sizeof *p);
    p->options = own;
    p->budget = ATH_PLAYER_BUDGET;
    p->built = -1;
    p->file = (ath_file *)ath_player_block_of(p, file_size);
    result = p->file ? ath_open_start(p->file, file_size, bytes, size, own.limits, &p->fault) : ATH_NO_MEMORY;
    if (result == ATH_MORE && !own.in_slices) result = ath_player_build(p, &exactly);
    if (fault) *fault = p->fault;
    if (result != ATH_OK && result != ATH_MORE) {
        ath_player_close(p);
        return result;
    }
    *player = p;
    return result;
}

static void ath_player_free_jobs(ath_player *p, ath_player_job *job)
{
    while (job) {
        ath_player_job *next = job->next;
        ath_player_give(&p->options, job->entry);
        ath_player_give(&p->options, job);
        job = next;
    }
}

void ath_player_close(ath_player *player)
{
    if (!player) return;
    ath_player_options options = player->options;
    ath_player_free_jobs(player, player->jobs);
    ath_player_free_jobs(player, player->idle);
    for (ath_player_entry *entry = player->entries, *next; entry; entry = next) {
        next = entry->next;
        ath_player_give(&options, entry);
    }
    for (ath_player_block *block = player->blocks, *next; block; block = next) {
        next = block->next;
        ath_player_give(&options, block);
    }
    ath_player_give(&options, player);
}

void ath_player_set_budget(ath_player *player, int32_t vertex_frames) { player->budget = vertex_frames; }
uint64_t ath_player_prepared(const ath_player *player) { return player->prepared; }
const ath_file *ath_player_file(const ath_player *player) { return player->file; }
const ath_fault_info *ath_player_fault(const ath_player *player) { return &player->fault; }

/* ---- prepared segments ---- */

static ath_player_entry *ath_player_find(const ath_player *p, int32_t segment, int32_t level)
{
    ath_player_entry *entry = p->entries;
    while (entry && (entry->segment != segment || entry->level != level)) entry = entry->next;
    return entry;
}

/* Frees the segments that were shown longest ago until `size` bytes fit, but none that this call has used. */
static void ath_player_make_room(ath_player *p, size_t size)
{
    while (p->cached + size > p->options.cache_bytes) {
        ath_player_entry **oldest = NULL;
        for (ath_player_entry **at = &p->entries; *at; at = &(*at)->next)
            if ((*at)->used < p->calls && (!oldest || (*at)->used < (*oldest)->used)) oldest = at;
        if (!oldest) return;
        ath_player_entry *gone = *oldest;
        *oldest = gone->next;
        p->cached -= gone->size;
        ath_player_give(&p->options, gone);
    }
}

static void ath_player_insert(ath_player *p, ath_player_entry *entry)
{
    ath_player_make_room(p, entry->size);
    entry->next = p->entries;
    p->entries = entry;
    p->cached += entry->size;
}

/* Returns a job with work memory, which is reused. */
static ath_player_job *ath_player_idle_job(ath_player *p)
{
    ath_player_job *job = p->idle;
    size_t size = ath_work_size(p->file);
    if (job) {
        p->idle = job->next;
    } else {
        char *memory = (char *)ath_player_take(&p->options, ATH_PLAYER_HEAD + size);
        if (!memory) return NULL;
        job = (ath_player_job *)memory;
        job->work = (ath_work *)(memory + ATH_PLAYER_HEAD);
    }
    job->entry = NULL;
    job->result = ATH_MORE;
    return job;
}

static void ath_player_retire(ath_player *p, ath_player_job *job)
{
    ath_player_give(&p->options, job->entry);
    job->entry = NULL;
    job->next = p->idle;
    p->idle = job;
}

/* Begins to prepare a segment, from the end of the one that it is joined to if that is cached. */
static int ath_player_start(ath_player *p, int32_t segment, int32_t level, ath_player_job **started)
{
    size_t size = p->sizes[level], work_size = ath_work_size(p->file);
    ath_player_entry *before = ath_player_find(p, ath_joined_to(p->file, segment, level), level);
    ath_player_job *job = ath_player_idle_job(p);
    if (!job) return ATH_NO_MEMORY;
    job->entry = (ath_player_entry *)ath_player_take(&p->options, ATH_PLAYER_HEAD + size);
    int result = ATH_NO_MEMORY;
    if (job->entry) {
        memset(job->entry, 0, ATH_PLAYER_HEAD);
        job->entry->size = ATH_PLAYER_HEAD + size;
        job->entry->segment = segment;
        job->entry->level = level;
        result =
            ath_prepare_start(job->work, work_size, p->file, segment, level, ath_player_memory_of(job->entry), size);
    }
    if (result != ATH_OK) {
        if (job->entry) ath_work_fault(job->work, &p->fault);
        ath_player_retire(p, job);
        return result;
    }
    if (before) ath_follow(job->work, (const ath_segment *)ath_player_memory_of(before));
    job->next = p->jobs;
    p->jobs = job;
    *started = job;
    return ATH_OK;
}

/* Runs a job for what is left of a budget. Returns what that cost. */
static int64_t ath_player_spend(ath_player_job *job, int32_t *budget)
{
    int64_t cost = 0;
    while (job->result == ATH_MORE && *budget > 0) {
        int32_t left = *budget;
        job->result = ath_prepare_within(job->work, &left);
        cost += (int64_t)*budget - left;
        if (*budget != ATH_PLAYER_EXACT) *budget = left;
    }
    return cost;
}

int ath_player_run(ath_player_job *job, int32_t vertex_frames)
{
    ath_player_spend(job, &vertex_frames);
    return job->result;
}

void ath_player_end(ath_player *player, ath_player_job *job)
{
    ath_player_job **at = &player->jobs;
    while (*at != job) at = &(*at)->next;
    *at = job->next;
    if (player->own == job) player->own = NULL;
    if (job->result != ATH_OK && job->result != ATH_MORE) ath_work_fault(job->work, &player->fault);
    if (job->result == ATH_OK && !ath_player_find(player, job->entry->segment, job->entry->level)) {
        job->entry->used = player->calls;
        ath_player_insert(player, job->entry);
        job->entry = NULL;
    }
    ath_player_retire(player, job);
}

/* What failed may succeed with these bytes. */
void ath_player_feed(ath_player *player, const uint8_t *bytes, uint64_t offset, size_t size)
{
    ath_feed(player->file, bytes, offset, size);
    player->refused = ATH_OK;
    if (player->own && player->own->result != ATH_MORE) ath_player_end(player, player->own);
}

/* Returns the job that prepares a segment at a level; null: none. */
static ath_player_job *ath_player_job_of(const ath_player *p, int32_t segment, int32_t level)
{
    ath_player_job *job = p->jobs;
    while (job && (job->entry->segment != segment || job->entry->level != level)) job = job->next;
    return job;
}

/* Gets the job to run for a segment: the player's own. It drops the one for another segment, or has that finished. */
static int ath_player_own_job(ath_player *p, int32_t segment, int32_t level, ath_player_job **job)
{
    if (p->own && p->own != ath_player_job_of(p, segment, level) && p->dropped++ < ATH_PLAYER_DROPS)
        ath_player_end(p, p->own);
    int result = p->own ? ATH_OK : ath_player_start(p, segment, level, &p->own);
    *job = p->own;
    return result;
}

/* Prepares a segment at a level for a budget. Returns ATH_OK: it is cached, or a job of the caller's prepares it;
 * ATH_MORE; or an error. The player's own job is kept if it has failed, since another one would only fail again. */
static int ath_player_prepare(ath_player *p, int32_t segment, int32_t level, int32_t *budget)
{
    ath_player_entry *entry;
    while (!(entry = ath_player_find(p, segment, level))) {
        ath_player_job *job = ath_player_job_of(p, segment, level);
        int is_exact = *budget == ATH_PLAYER_EXACT, result = ATH_OK;
        if (job && job != p->own && !is_exact) return ATH_OK;
        if (*budget <= 0) return ATH_MORE;
        if ((result = ath_player_refine(p, level, budget)) != ATH_OK) return result;
        if (!is_exact)
            result = ath_player_own_job(p, segment, level, &job);
        else if (!job || job != p->own)
            result = ath_player_start(p, segment, level, &job);
        if (result != ATH_OK) return result;
        p->prepared += (uint64_t)ath_player_spend(job, budget);
        result = job->result;
        if (result == ATH_MORE) return result;
        int has_failed = result != ATH_OK && job->entry->segment == segment && job->entry->level == level;
        if (has_failed) ath_work_fault(job->work, &p->fault);
        if (!has_failed || job != p->own) ath_player_end(p, job);
        if (has_failed) return result;
        p->dropped = 0;
    }
    entry->used = p->calls;
    return ATH_OK;
}

/* ---- showing ---- */

/* Returns whether a segment has the bytes of a level. Those of a coarser level need not be among them. */
static int ath_player_has(const ath_player *p, int32_t segment, int32_t level)
{
    return ath_ranges(p->file, level, segment, segment, 0, NULL, 0) == 0;
}

/* Returns the deepest level up to `level` (-1: any) whose bytes a segment has; -1: none. */
static int32_t ath_player_level_of(const ath_player *p, int32_t segment, int32_t level)
{
    int32_t ready = ath_ready_level(p->file, segment);
    if (level < 0 || level >= ready) return ready;
    while (level >= 0 && !ath_player_has(p, segment, level)) level--;
    return level;
}

/* Returns the same for both segments of a blend. */
static int32_t ath_player_level_at(const ath_player *p, const ath_blend *blend, int32_t level)
{
    int32_t before;
    do {
        before = level;
        for (int32_t i = 0; i < 2 && (i == 0 || level >= 0); i++)
            level = ath_player_level_of(p, blend->segment[i], level);
    } while (level >= 0 && level != before);
    return level;
}

/* Returns the best level up to `most` that is prepared of a segment, `level` or else a deeper one, or else a coarser
 * one; -1: none. */
static int32_t ath_player_best(const ath_player *p, int32_t segment, int32_t level, int32_t most)
{
    for (int32_t best = level; best <= most; best++)
        if (ath_player_find(p, segment, best)) return best;
    while (level >= 0 && !ath_player_find(p, segment, level)) level--;
    return level;
}

/* Returns the coarsest level whose bytes a segment has, among which are those of `level`. */
static int32_t ath_player_coarsest(const ath_player *p, int32_t segment, int32_t level)
{
    int32_t coarsest = 0;
    while (coarsest < level && !ath_player_has(p, segment, coarsest)) coarsest++;
    return coarsest;
}

/* Returns the level to prepare next on the way to a level: first the deepest of at most an eighth of its size. */
static int32_t ath_player_aim(const ath_player *p, int32_t segment, int32_t level)
{
    int32_t aim = level;
    if (ath_player_find(p, segment, level) || ath_player_job_of(p, segment, level)) return level;
    while (aim >= 0 && (p->sizes[aim] > p->sizes[level] / 8 || !ath_player_has(p, segment, aim))) aim--;
    return aim >= 0 && ath_player_best(p, segment, aim, p->deepest) < aim ? aim : level;
}

/* Returns the segment that comes after the one shown; -1: none. */
static int32_t ath_player_next(const ath_player *p, const ath_player_track *now)
{
    const ath_clip *clip = ath_clips(p->file) + now->clip;
    int32_t last = clip->first_segment + clip->segment_count - 1, next = now->segment + now->direction;
    if (next >= clip->first_segment && next <= last) return next;
    if (now->wrap == ATH_LOOP) return next > last ? clip->first_segment : last;
    if (now->wrap == ATH_PING_PONG && clip->segment_count > 1) return now->segment - now->direction;
    return -1;
}

/* Returns the level at which the segment that comes next is prepared before a level of this one is, so that the plant is
 * as good there as here until then; -1: none. A job for this one goes on, since it would have to begin anew. */
static int32_t ath_player_aim_after(const ath_player *p, const ath_player_track *now, int32_t level, int32_t *next)
{
    *next = ath_player_next(p, now);
    if (*next < 0 || p->budget == ATH_PLAYER_EXACT || ath_player_job_of(p, now->segment, level)) return -1;
    level = ath_player_level_of(p, *next, level);
    int32_t aim = level >= 0 ? ath_player_aim(p, *next, level) : -1;
    return aim < level ? aim : -1;
}

/* Gets the segments of a moment at a level or, until they are prepared, at the best level up to `most`. */
static int ath_player_moment_at(ath_player *p, const ath_player_track *now, int32_t level, int32_t most,
                                ath_player_moment *moment)
{
    ath_blend blend = ath_blend_at(p->file, now->frame);
    int32_t count = blend.segment[1] != blend.segment[0] ? 2 : 1, exactly = ATH_PLAYER_EXACT, next, after;
    int result = ATH_OK;
    level = ath_player_level_at(p, &blend, level);
    moment->frame = now->frame;
    moment->level = level;
    moment->segment_count = 0;
    if (level < 0) return ATH_MISSING;
    int32_t best = ath_player_best(p, blend.segment[0], level, most);
    if (best >= 0)
        ath_player_find(p, blend.segment[0], best)->used = p->calls;
    else if (p->left != exactly)
        result = ath_player_prepare(p, blend.segment[0], ath_player_coarsest(p, blend.segment[0], level), &exactly);
    int32_t aim = ath_player_aim(p, blend.segment[0], level);
    if (result == ATH_OK && p->left != exactly && aim < level)
        result = ath_player_prepare(p, blend.segment[0], aim, &p->left);
    if (result == ATH_OK && p->left != exactly && (after = ath_player_aim_after(p, now, level, &next)) >= 0)
        (void)ath_player_prepare(p, next, after, &p->left); /* its damage is told when it is shown */
    for (int32_t i = 0; i < count && result == ATH_OK; i++)
        result = ath_player_prepare(p, blend.segment[i], level, &p->left);
    if (result != ATH_OK && result != ATH_MORE) return result;
    moment->level = ath_player_best(p, blend.segment[0], level, most);
    for (int32_t i = 0; i < count; i++) {
        ath_player_entry *entry = ath_player_find(p, blend.segment[i], moment->level);
        if (!entry) continue;
        entry->used = p->calls;
        moment->segments[moment->segment_count++] = (const ath_segment *)ath_player_memory_of(entry);
    }
    return ATH_OK;
}

/* before: null, or where the clip was when it was shown last. */
static ath_player_track ath_player_track_of(const ath_player *p, const ath_player_track *before,
                                            const ath_player_share *share)
{
    ath_player_track now;
    ath_wrap wrap = share->wrap;
    now.frame = ath_frame_at(p->file, share->clip, share->seconds, wrap);
    if (wrap == ATH_AS_MARKED) wrap = ath_clips(p->file)[share->clip].loop ? ATH_LOOP : ATH_CLAMP;
    now.clip = share->clip;
    now.segment = ath_blend_at(p->file, now.frame).segment[0];
    now.level = share->level;
    now.wrap = wrap;
    now.direction = before ? before->direction : 1;
    int wrapped =
        before && wrap == ATH_LOOP && (now.segment > before->segment + 1 || now.segment < before->segment - 1);
    if (before && !wrapped && now.frame != before->frame) now.direction = now.frame < before->frame ? -1 : 1;
    return now;
}

/* Shows these clips from now on. */
static int ath_player_move(ath_player *p, const ath_player_share *shares, int32_t count)
{
    ath_player_track tracks[ATH_BLEND_CLIPS];
    for (int32_t i = 0; i < count; i++) {
        const ath_player_track *before = NULL;
        if (shares[i].clip < 0 || shares[i].clip >= p->info.clip_count) return ATH_BAD_ARGUMENT;
        for (int32_t k = 0; k < p->track_count && !before; k++)
            if (p->tracks[k].clip == shares[i].clip) before = p->tracks + k;
        tracks[i] = ath_player_track_of(p, before, shares + i);
    }
    for (int32_t i = 0; i < count; i++) p->tracks[i] = tracks[i];
    p->track_count = count;
    p->left = p->budget;
    p->calls++;
    return ATH_OK;
}

static int ath_player_move_one(ath_player *p, int32_t clip, double seconds, ath_wrap wrap, int32_t level, double *frame)
{
    ath_player_share share = {clip, level, wrap, seconds, 1.0};
    int result = ath_player_move(p, &share, 1);
    *frame = result == ATH_OK ? p->tracks[0].frame : 0.0;
    return result;
}

int ath_player_show(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, int32_t level,
                    ath_player_moment *moment)
{
    double frame;
    int result = ath_player_move_one(player, clip, seconds, wrap, level, &frame);
    return result == ATH_OK ? ath_player_moment_at(player, player->tracks, level, player->deepest, moment) : result;
}

int ath_player_positions(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, int32_t level,
                         ath_order order, float *xyz, size_t stride)
{
    ath_player_moment moment;
    int result = ath_player_show(player, clip, seconds, wrap, level, &moment);
    if (result != ATH_OK) return result;
    return ath_positions(player->file, moment.segments, moment.segment_count, moment.frame, order, xyz, stride);
}

int ath_player_matrices(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, int32_t level, float *matrices,
                        float *exact, int32_t *shown)
{
    const size_t size = sizeof(float);
    ath_player_moment now;
    double frame;
    int result = ath_player_move_one(player, clip, seconds, wrap, level, &frame);
    if (result == ATH_OK)
        result = ath_player_moment_at(player, player->tracks, level, level < 0 ? player->deepest : level, &now);
    if (result != ATH_OK) return result;
    if (shown) *shown = now.level;
    result = ath_matrices(player->file, now.segments, now.segment_count, now.frame, matrices, 12 * size);
    if (result != ATH_OK) return result;
    return ath_exact(player->file, now.segments, now.segment_count, now.frame, exact, 3 * size);
}

int ath_player_faded_positions(ath_player *player, int32_t clip, double seconds, ath_wrap wrap, const ath_fade *fade,
                               ath_order order, float *xyz, size_t stride)
{
    const ath_segment *segments[2 * ATH_FADE_LEVELS];
    int32_t count = 0, latest = fade->count > 0 ? fade->level[fade->count - 1] : 0;
    ath_fade shown = *fade;
    double frame;
    int result = ath_player_move_one(player, clip, seconds, wrap, latest, &frame);
    if (result != ATH_OK) return result;
    for (int32_t i = 0; i < fade->count; i++) {
        ath_player_moment moment;
        result = ath_player_moment_at(player, player->tracks, fade->level[i], player->deepest, &moment);
        if (result != ATH_OK) return result;
        shown.level[i] = moment.level;
        for (int32_t k = 0; k < moment.segment_count; k++) segments[count++] = moment.segments[k];
    }
    return ath_faded_positions(player->file, segments, count, frame, &shown, order, xyz, stride);
}

/* ---- several clips ---- */

/* Copies the shares that have a weight and returns their number; -1: more than ATH_BLEND_CLIPS. */
static int32_t ath_player_used(const ath_player_share *shares, int32_t count, ath_player_share *used)
{
    int32_t found = 0;
    for (int32_t i = 0; i < count; i++) {
        if (!(shares[i].weight > 0.0)) continue;
        if (found == ATH_BLEND_CLIPS) return -1;
        used[found++] = shares[i];
    }
    return found;
}

int ath_player_blended_positions(ath_player *player, const ath_player_share *shares, int32_t share_count,
                                 ath_order order, float *xyz, size_t stride)
{
    ath_player_share used[ATH_BLEND_CLIPS];
    ath_player_moment moments[ATH_BLEND_CLIPS];
    ath_share blended[ATH_BLEND_CLIPS];
    size_t size = ath_blend_size(player->file);
    int32_t count = ath_player_used(shares, share_count, used);
    if (count <= 0) return ATH_BAD_ARGUMENT;
    int result = ath_player_move(player, used, count);
    if (result != ATH_OK) return result;
    if (count > 1 && !player->blending && !(player->blending = ath_player_block_of(player, size))) return ATH_NO_MEMORY;
    for (int32_t i = 0; i < count; i++) {
        result = ath_player_moment_at(player, player->tracks + i, used[i].level, player->deepest, moments + i);
        if (result != ATH_OK) return result;
        ath_share share = {moments[i].segments, moments[i].segment_count, moments[i].frame, used[i].weight};
        blended[i] = share;
    }
    return ath_blended_positions(player->file, blended, count, order, xyz, stride, player->blending,
                                 player->blending ? size : 0);
}

int ath_player_wind_positions(ath_player *player, const ath_wind *winds, double strength, double heading,
                              double seconds, ath_wrap wrap, int32_t level, ath_order order, float *xyz, size_t stride)
{
    ath_player_share shares[ATH_BLEND_CLIPS];
    size_t size = (size_t)player->info.clip_count * sizeof(double);
    int32_t count = 0;
    if (!player->weights && !(player->weights = (double *)ath_player_block_of(player, size))) return ATH_NO_MEMORY;
    ath_wind_weights(winds, player->info.clip_count, strength, heading, player->weights);
    for (int32_t i = 0; i < player->info.clip_count && count < ATH_BLEND_CLIPS; i++) {
        if (!(player->weights[i] > 0.0)) continue;
        ath_player_share share = {i, level, wrap, seconds, player->weights[i]};
        shares[count++] = share;
    }
    return ath_player_blended_positions(player, shares, count, order, xyz, stride);
}

/* ---- preparing ahead ---- */

/* What is prepared of each clip that is shown, in this order. */
enum { ATH_PLAYER_AIM, ATH_PLAYER_AIM_AFTER, ATH_PLAYER_LEVEL, ATH_PLAYER_BLENDED, ATH_PLAYER_WISHES };

/* Gets one of the segments to prepare, from place 0 on: those wishes of each clip, then the next segment of each;
 * -1: none. Returns 0 after the last place. */
static int ath_player_wish(const ath_player *p, int32_t place, int32_t *segment, int32_t *level)
{
    int32_t shown = ATH_PLAYER_WISHES * p->track_count, wish = place < shown ? place % ATH_PLAYER_WISHES : -1;
    if (place >= shown + p->track_count) return 0;
    const ath_player_track *track = p->tracks + (place < shown ? place / ATH_PLAYER_WISHES : place - shown);
    ath_blend blend = ath_blend_at(p->file, track->frame);
    *segment = wish < 0 ? ath_player_next(p, track) : blend.segment[wish == ATH_PLAYER_BLENDED];
    *level = wish < 0 ? track->level : ath_player_level_at(p, &blend, track->level);
    if (wish < 0 && *segment >= 0) *level = ath_player_level_of(p, *segment, *level);
    if (wish == ATH_PLAYER_AIM && *level >= 0) *level = ath_player_aim(p, *segment, *level);
    if (wish == ATH_PLAYER_AIM_AFTER && *level >= 0) *level = ath_player_aim_after(p, track, *level, segment);
    if (*level < 0) *segment = -1;
    return 1;
}

ath_player_job *ath_player_begin(ath_player *player)
{
    ath_player_job *job = NULL;
    int32_t segment, level, budget = ATH_PLAYER_BUDGET, result = ATH_OK;
    for (int32_t i = 0; !job && result != ATH_MORE && ath_player_wish(player, i, &segment, &level); i++)
        if (segment >= 0 && !ath_player_find(player, segment, level) && !ath_player_job_of(player, segment, level)) {
            result = ath_player_refine(player, level, &budget);
            if (result == ATH_OK) ath_player_start(player, segment, level, &job);
        }
    return job;
}

int ath_player_ahead(ath_player *player, int32_t vertex_frames)
{
    int result = player->built < 0 ? ath_player_build(player, &vertex_frames) : ATH_OK;
    int32_t segment, level;
    for (int32_t i = 0; result == ATH_OK && ath_player_wish(player, i, &segment, &level); i++)
        if (segment >= 0) result = ath_player_prepare(player, segment, level, &vertex_frames);
    return result;
}

/* ---- topology ---- */

static void ath_player_reorder(const ath_player *p, ath_order order, uint32_t *vertices, size_t count)
{
    const int32_t *places = ath_vertex_places(p->file);
    for (size_t i = 0; order == ATH_FILE_ORDER && i < count; i++) vertices[i] = (uint32_t)places[vertices[i]];
}

/* Splits polygons into fans of primitives with `size` corners. */
static size_t ath_player_split(const ath_polygons *shape, const uint32_t *counts, const int32_t *corners, uint32_t size,
                               uint32_t *primitives)
{
    size_t made = 0;
    for (uint32_t face = 0; face < shape->face_count; face++) {
        uint32_t count = counts ? counts[face] : shape->columns;
        for (uint32_t i = size - 1; i < count; i++, made++) {
            if (!primitives) continue;
            uint32_t *own = primitives + made * size;
            own[0] = (uint32_t)corners[size == 2 ? i - 1 : 0];
            if (size == 3) own[1] = (uint32_t)corners[i - 1];
            own[size - 1] = (uint32_t)corners[i];
        }
        corners += count;
    }
    return made;
}

static int ath_player_primitives(ath_player *p, int kind, uint32_t size, ath_order order, uint32_t *out, size_t *count)
{
    ath_polygons shape;
    int result = ath_polygons_of(p->file, kind, &shape, &p->fault);
    if (result != ATH_OK) return result;
    size_t counts_size = shape.is_mixed ? shape.face_count * sizeof(uint32_t) : 0,
           work_size = ath_polygons_size(p->file);
    char *memory = (char *)ath_player_take(&p->options, work_size);
    uint32_t *counts = (uint32_t *)ath_player_take(&p->options, counts_size);
    int32_t *corners = (int32_t *)ath_player_take(&p->options, shape.corner_count * sizeof(int32_t));
    result = memory && counts && corners ? ATH_OK : ATH_NO_MEMORY;
    if (result == ATH_OK)
        result =
            ath_read_polygons(p->file, kind, memory, work_size, shape.is_mixed ? counts : NULL, corners, &p->fault);
    if (result == ATH_OK) *count = ath_player_split(&shape, shape.is_mixed ? counts : NULL, corners, size, out);
    ath_player_give(&p->options, memory);
    ath_player_give(&p->options, counts);
    ath_player_give(&p->options, corners);
    if (result == ATH_OK && out) ath_player_reorder(p, order, out, *count * size);
    return result;
}

int ath_player_triangles(ath_player *player, ath_order order, uint32_t *triangles, size_t *count)
{
    return ath_player_primitives(player, ATH_FACES, 3, order, triangles, count);
}

/* Connects the vertices of each stem, and the first of them to the attach vertex. */
static size_t ath_player_stem_lines(const ath_player *p, ath_order order, uint32_t *lines)
{
    const ath_branch *branches = ath_branches(p->file);
    const int32_t *source = ath_vertex_source(p->file);
    size_t made = 0;
    for (int32_t b = 0; b < p->info.branch_count; b++)
        for (int32_t i = 0; i < branches[b].count; i++) {
            int32_t to = branches[b].first + i, from = i > 0 ? to - 1 : branches[b].attach;
            if (from < 0) continue;
            if (lines) lines[2 * made] = (uint32_t)(order == ATH_SOURCE_ORDER ? source[from] : from);
            if (lines) lines[2 * made + 1] = (uint32_t)(order == ATH_SOURCE_ORDER ? source[to] : to);
            made++;
        }
    return made;
}

int ath_player_lines(ath_player *player, ath_order order, uint32_t *lines, size_t *count)
{
    ath_polygons shape;
    int result = ath_polygons_of(player->file, ATH_EDGES, &shape, &player->fault);
    if (result == ATH_OK && !shape.is_derived) return ath_player_primitives(player, ATH_EDGES, 2, order, lines, count);
    if (result != ATH_OK && result != ATH_BAD_ARGUMENT) return result;
    *count = ath_player_stem_lines(player, order, lines);
    return ATH_OK;
}

/* ---- bounds, normals and tangents ---- */

static const float *ath_player_at(const float *first, size_t stride, uint32_t index)
{
    return (const float *)((const char *)first + stride * index);
}

void ath_player_bounds(const float *xyz, size_t stride, int32_t vertex_count, float *box)
{
    for (int32_t i = 0; i < vertex_count; i++) {
        const float *at = ath_player_at(xyz, stride, (uint32_t)i);
        for (int k = 0; k < 3; k++) {
            if (i == 0 || at[k] < box[k]) box[k] = at[k];
            if (i == 0 || at[k] > box[3 + k]) box[3 + k] = at[k];
        }
    }
}

static void ath_player_edge(const float *from, const float *to, float *edge)
{
    for (int k = 0; k < 3; k++) edge[k] = to[k] - from[k];
}

static void ath_player_cross(const float *a, const float *b, float *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static float ath_player_dot(const float *a, const float *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Leaves a vector of length 0 as it is. */
static void ath_player_normalise(float *vector)
{
    float length = sqrtf(ath_player_dot(vector, vector)), scale = length > 0.0f ? 1.0f / length : 0.0f;
    for (int k = 0; k < 3; k++) vector[k] *= scale;
}

void ath_player_normals(const uint32_t *triangles, size_t count, const float *xyz, size_t stride, int32_t vertex_count,
                        float *normals)
{
    memset(normals, 0, (size_t)vertex_count * 3 * sizeof(float));
    for (const uint32_t *corner = triangles, *end = triangles + 3 * count; corner < end; corner += 3) {
        const float *first = ath_player_at(xyz, stride, corner[0]);
        float a[3], b[3], normal[3];
        ath_player_edge(first, ath_player_at(xyz, stride, corner[1]), a);
        ath_player_edge(first, ath_player_at(xyz, stride, corner[2]), b);
        ath_player_cross(a, b, normal);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) normals[3 * (size_t)corner[i] + (size_t)k] += normal[k];
    }
    for (int32_t i = 0; i < vertex_count; i++) ath_player_normalise(normals + 3 * (size_t)i);
}

/* Adds the surface's derivative by u to the tangents of the corners, and the signed area in uv to their fourth
 * number. */
static void ath_player_add_tangent(const uint32_t *corner, const float *xyz, size_t stride, const float *uv,
                                   size_t uv_stride, float *tangents)
{
    const float *first = ath_player_at(xyz, stride, corner[0]), *origin = ath_player_at(uv, uv_stride, corner[0]);
    const float *second = ath_player_at(uv, uv_stride, corner[1]), *third = ath_player_at(uv, uv_stride, corner[2]);
    float u1 = second[0] - origin[0], v1 = second[1] - origin[1], u2 = third[0] - origin[0], v2 = third[1] - origin[1];
    float a[3], b[3], area = u1 * v2 - u2 * v1, sign = area < 0.0f ? -1.0f : 1.0f;
    ath_player_edge(first, ath_player_at(xyz, stride, corner[1]), a);
    ath_player_edge(first, ath_player_at(xyz, stride, corner[2]), b);
    for (int i = 0; i < 3; i++) {
        float *own = tangents + 4 * (size_t)corner[i];
        for (int k = 0; k < 3; k++) own[k] += sign * (a[k] * v2 - b[k] * v1);
        own[3] += area;
    }
}

void ath_player_tangents(const uint32_t *triangles, size_t count, const float *xyz, size_t stride, const float *uv,
                         size_t uv_stride, const float *normals, int32_t vertex_count, float *tangents)
{
    memset(tangents, 0, (size_t)vertex_count * 4 * sizeof(float));
    for (size_t i = 0; i < count; i++) ath_player_add_tangent(triangles + 3 * i, xyz, stride, uv, uv_stride, tangents);
    for (int32_t i = 0; i < vertex_count; i++) {
        float *own = tangents + 4 * (size_t)i, along = ath_player_dot(own, normals + 3 * (size_t)i);
        for (int k = 0; k < 3; k++) own[k] -= along * normals[3 * (size_t)i + (size_t)k];
        ath_player_normalise(own);
        own[3] = own[3] < 0.0f ? -1.0f : 1.0f;
    }
}

#ifdef __cplusplus
}
#endif
#endif
#endif
