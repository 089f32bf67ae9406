#define _POSIX_C_SOURCE 200809L /* barriers, locks for reading and writing */
/* Many threads on the decoder's C core, for ThreadSanitizer (load.py builds and runs this): all that ath.h allows at
 * once. Threads prepare segments of shared and of their own files, play segments that all of them share, and one feeds
 * and drops bytes, alone among those that look at bytes. What they show is compared with what one thread alone saw.
 *
 *     threads THREADS ROUNDS FILE...
 *     threads race 2 FILE     two threads on one ath_work, which ath.h forbids: the sanitizer has to say so. They use it
 *                             one after the other, without synchronisation, so that nothing breaks before it does
 */
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ath.h"

typedef struct {
    uint8_t *bytes;
    size_t size;
    ath_file *file;
    ath_info info;
    uint32_t *seen;           /* CRC of each (segment, level), as one thread alone decoded it */
    ath_segment **prepared;   /* all (segment, level), shared by those who play */
    pthread_rwlock_t feeding; /* taken to write by who feeds, to read by who prepares */
} plant;

static plant *plants;
static int plant_count, thread_count, rounds;
static atomic_long preparations, frames, feeds, wrong;
static pthread_barrier_t start;
static atomic_int raced;

static void *memory_of(size_t size)
{
    void *memory = aligned_alloc(64, (size + 64) & ~(size_t)63);
    if (!memory) abort();
    return memory;
}

static void expect(int result, const char *what)
{
    if (result == ATH_OK) return;
    fprintf(stderr, "%s: %s\n", what, ath_result_name(result));
    exit(1);
}

static uint32_t next(uint32_t *state) { return *state = *state * 1664525u + 1013904223u; }
static int32_t draw(uint32_t *state, int32_t below) { return (int32_t)((next(state) >> 8) % (uint32_t)below); }

/* CRC of what a segment shows in its first, middle and last frame. */
static uint32_t look(const plant *p, const ath_segment *segment, float *positions)
{
    int32_t index = ath_segment_index(segment), first = ath_segment_start(p->file, index);
    int32_t last = ath_segment_start(p->file, index + 1) - 1, at[3] = {first, (first + last) / 2, last};
    size_t bytes = (size_t)p->info.vertex_count * 3 * sizeof(float);
    uint32_t crc = 0;
    for (int i = 0; i < 3; i++) {
        expect(ath_positions(p->file, &segment, 1, at[i], ATH_SOURCE_ORDER, positions, 3 * sizeof(float)), "positions");
        const uint8_t *byte = (const uint8_t *)positions;
        for (size_t k = 0; k < bytes; k++) crc = (crc ^ byte[k]) * 16777619u;
        frames++;
    }
    return crc;
}

static void read_file(plant *p, const char *path)
{
    FILE *in = fopen(path, "rb");
    if (!in || fseek(in, 0, SEEK_END) != 0) exit(2);
    p->size = (size_t)ftell(in);
    p->bytes = memory_of(p->size);
    rewind(in);
    if (fread(p->bytes, 1, p->size, in) != p->size) exit(2);
    fclose(in);
}

static void open_plant(plant *p)
{
    size_t front, size;
    expect(ath_front(p->bytes, p->size, NULL, &front, &size, NULL), "front");
    p->file = memory_of(size);
    expect(ath_open(p->file, size, p->bytes, p->size, NULL, NULL), "open");
    expect(ath_build(p->file, memory_of(ath_build_size(p->file)), ath_build_size(p->file)), "build");
    ath_get_info(p->file, &p->info);
    expect(ath_refine_size(p->file, p->info.level_count - 1, &size, NULL), "refine size");
    expect(ath_refine(p->file, p->info.level_count - 1, memory_of(size), size), "refine");
    pthread_rwlock_init(&p->feeding, NULL);
}

static ath_segment *prepare(const plant *p, void *work, int32_t segment, int32_t level, ath_segment *memory)
{
    size_t size = ath_segment_size(p->file, level);
    if (!memory) memory = memory_of(size);
    expect(ath_prepare(work, ath_work_size(p->file), p->file, segment, level, memory, size), "prepare");
    preparations++;
    return memory;
}

static void see_alone(plant *p)
{
    int32_t count = p->info.segment_count * p->info.level_count;
    void *work = memory_of(ath_work_size(p->file));
    float *positions = memory_of((size_t)p->info.vertex_count * 3 * sizeof(float));
    p->seen = memory_of((size_t)count * sizeof *p->seen);
    p->prepared = memory_of((size_t)count * sizeof *p->prepared);
    for (int32_t i = 0; i < count; i++) {
        p->prepared[i] = prepare(p, work, i / p->info.level_count, i % p->info.level_count, NULL);
        p->seen[i] = look(p, p->prepared[i], positions);
    }
    free(work);
    free(positions);
}

/* Memory of a segment at any level: coarse ones, which hold matrices, can take more than the finest. */
static size_t largest_segment(const plant *p)
{
    size_t most = 0;
    for (int32_t level = 0; level < p->info.level_count; level++)
        if (ath_segment_size(p->file, level) > most) most = ath_segment_size(p->file, level);
    return most;
}

/* One plant for a while: its own work and segment, the shared ones in between, and all that only reads. */
static void visit(plant *p, uint32_t *state, int own)
{
    void *work = memory_of(ath_work_size(p->file));
    ath_segment *mine = memory_of(largest_segment(p));
    float *positions = memory_of((size_t)p->info.vertex_count * 3 * sizeof(float));
    float *matrices = memory_of(((size_t)p->info.node_count + 1) * 12 * sizeof(float));
    for (int i = 0; i < 8; i++) {
        int32_t segment = draw(state, p->info.segment_count), level = draw(state, p->info.level_count);
        int32_t index = segment * p->info.level_count + level, shown = draw(state, p->info.segment_count);
        ath_range ranges[8];
        pthread_rwlock_rdlock(&p->feeding);
        prepare(p, work, segment, level, mine);
        ath_ranges(p->file, level, segment, segment, 1, ranges, 8);
        expect(ath_check_chunk(p->file, draw(state, p->info.chunk_count), NULL), "chunk");
        pthread_rwlock_unlock(&p->feeding);
        wrong += look(p, mine, positions) != p->seen[index];
        if (!own) {
            index = shown * p->info.level_count + level;
            wrong += look(p, p->prepared[index], positions) != p->seen[index];
            const ath_segment *segment_shown = p->prepared[index];
            double frame = ath_segment_start(p->file, shown);
            expect(ath_matrices(p->file, &segment_shown, 1, frame, matrices, 12 * sizeof(float)), "matrices");
            expect(ath_exact(p->file, &segment_shown, 1, frame, positions, 3 * sizeof(float)), "exact");
            ath_level_for(p->file, 0, 0, ATH_P99, 10.0, 1.0, 1000.0, 1.0);
        }
    }
    free(work);
    free(mine);
    free(positions);
    free(matrices);
}

static void *wander(void *number)
{
    uint32_t state = 77u + (uint32_t)(size_t)number;
    plant own = plants[(size_t)number % (size_t)plant_count];
    open_plant(&own); /* the bytes are shared, the file is this thread's */
    pthread_barrier_wait(&start);
    for (int i = 0; i < rounds; i++) {
        visit(&plants[draw(&state, plant_count)], &state, 0);
        visit(&own, &state, 1);
    }
    return NULL;
}

static void *feed(void *unused)
{
    uint32_t state = 5u;
    (void)unused;
    pthread_barrier_wait(&start);
    for (int i = 0; i < rounds * 8; i++) {
        plant *p = &plants[draw(&state, plant_count)];
        uint64_t offset = next(&state) % p->size;
        pthread_rwlock_wrlock(&p->feeding);
        ath_drop(p->file, offset, p->size - offset);
        ath_feed(p->file, p->bytes, 0, p->size);
        pthread_rwlock_unlock(&p->feeding);
        feeds++;
    }
    return NULL;
}

static void *race(void *work)
{
    free(prepare(plants, work, 0, plants->info.level_count - 1, NULL));
    atomic_store_explicit(&raced, 1, memory_order_relaxed);
    return NULL;
}

static int run_race(void)
{
    pthread_t other;
    void *work = memory_of(ath_work_size(plants->file));
    pthread_create(&other, NULL, race, work);
    while (!atomic_load_explicit(&raced, memory_order_relaxed)) sched_yield();
    race(work);
    pthread_join(other, NULL);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc < 4) return 2;
    thread_count = atoi(argv[1]);
    rounds = atoi(argv[2]);
    plant_count = argc - 3;
    plants = calloc((size_t)plant_count, sizeof *plants);
    for (int i = 0; i < plant_count; i++) {
        read_file(&plants[i], argv[3 + i]);
        open_plant(&plants[i]);
        see_alone(&plants[i]);
    }
    if (!strcmp(argv[1], "race")) return run_race();
    pthread_t *threads = calloc((size_t)thread_count + 1, sizeof *threads);
    pthread_barrier_init(&start, NULL, (unsigned)thread_count + 1);
    for (int i = 0; i < thread_count; i++) pthread_create(&threads[i], NULL, wander, (void *)(size_t)i);
    pthread_create(&threads[thread_count], NULL, feed, NULL);
    for (int i = 0; i <= thread_count; i++) pthread_join(threads[i], NULL);
    printf("{\"preparations\": %ld, \"frames\": %ld, \"feeds\": %ld, \"wrong\": %ld}\n", (long)preparations,
           (long)frames, (long)feeds, (long)wrong);
    return wrong != 0;
}
