/* Fuzz target: two players of one file, in the same use, one of which keeps nothing and gets no memory now and then. What both
 * show is the same, errors are those that the header names, and all memory is given back. */
#define ATH_PLAYER_IMPLEMENTATION
#include "ath_player.h"
#include "harness.h"

enum { MOST_MEMORY = 8 << 20, CALLS = 8, JOBS = 2 };

/* Who hands out memory: none beyond MOST_MEMORY, nor every `scarce`-th time, 0: always. */
typedef struct {
    size_t held;
    uint32_t calls, scarce;
    int fill;
} heap;

static void *allocate(void *context, size_t size)
{
    heap *own = (heap *)context;
    own->calls++;
    if (size > MOST_MEMORY || (own->scarce > 0 && own->calls % own->scarce == 0)) return NULL;
    own->held++;
    return fuzz_memory(size, own->fill);
}

static void release(void *context, void *memory)
{
    ((heap *)context)->held--;
    free(memory);
}

typedef struct {
    ath_player *player;
    ath_info info;
    ath_player_job *jobs[JOBS];
    heap memory;
    int is_exact;
} user;

static int is_error(int result)
{
    return result == ATH_MISSING || result == ATH_BAD_CHECKSUM || result == ATH_BAD_CHUNK || result == ATH_NO_MEMORY
           || result == ATH_BAD_ARGUMENT || result == ATH_NOT_PREPARED;
}

static void open_player(user *u, const uint8_t *bytes, size_t size, uint32_t vertices, const uint8_t *options,
                        int scarce)
{
    ath_player_options how;
    ath_fault_info fault;
    ath_limits limits = fuzz_limits(2 << 20);
    float *mesh = fuzz_host_mesh(vertices);
    memset(u, 0, sizeof *u);
    memset(&how, 0, sizeof how);
    u->memory.scarce = scarce ? options[1] % 32 : 0;
    u->memory.fill = scarce ? 0xa5 : 0x5a;
    how.allocate = allocate;
    how.release = release;
    how.context = &u->memory;
    how.cache_bytes = scarce ? 1 : 0;
    how.limits = &limits;
    how.host_mesh = mesh;
    how.host_stride = 12;
    how.host_vertex_count = (int32_t)vertices;
    how.in_slices = scarce;
    int result = ath_player_open(&u->player, bytes, size, &how, &fault);
    while (result == ATH_MORE) result = ath_player_ahead(u->player, 1 + options[1] * 20);
    if (result != ATH_OK) ath_player_close(u->player);
    if (result != ATH_OK) u->player = NULL;
    free(mesh);
    REQUIRE((result == ATH_OK) == (u->player != NULL), "a player is there where opening was well");
    u->is_exact = options[0] % 4 > 0;
    if (u->player) {
        ath_player_set_budget(u->player, u->is_exact ? ATH_PLAYER_EXACT : options[1] * 200);
        ath_get_info(ath_player_file(u->player), &u->info);
    } else
        REQUIRE(u->memory.held == 0, "who is refused gives all memory back");
}

static void close_player(user *u)
{
    ath_player_close(u->player);
    REQUIRE(u->memory.held == 0, "who is closed gives all memory back");
}

/* What is shown of a moment: positions in source order; null where it is refused. */
static float *shown(user *u, int32_t clip, double seconds, ath_wrap wrap, int32_t level, int32_t way)
{
    size_t count = 3 * (size_t)u->info.vertex_count;
    float *xyz = fuzz_memory(count * sizeof *xyz, 0);
    ath_fade fade = {0};
    int result;
    ath_fade_to(&fade, way / 4 % u->info.level_count, 1.0);
    ath_fade_to(&fade, way / 2 % u->info.level_count, 0.25);
    ath_player_share shares[3] = {{clip, level, wrap, seconds, 1.0},
                                  {way % u->info.clip_count, way % u->info.level_count, ATH_LOOP, seconds, way / 8.0},
                                  {0, -1, ATH_PING_PONG, -seconds, 0.5}};
    if (way % 8 == 7)
        result = ath_player_blended_positions(u->player, shares, 3, ATH_SOURCE_ORDER, xyz, 12);
    else if (way % 2)
        result = ath_player_faded_positions(u->player, clip, seconds, wrap, &fade, ATH_SOURCE_ORDER, xyz, 12);
    else
        result = ath_player_positions(u->player, clip, seconds, wrap, level, ATH_SOURCE_ORDER, xyz, 12);
    if (result == ATH_OK || result == ATH_HELD) return xyz;
    REQUIRE(is_error(result), "showing gives its codes");
    free(xyz);
    return NULL;
}

/* What both show of one moment, which is freed. */
static void compare(user users[2], float *first, float *second)
{
    if (first && second && users[0].is_exact && users[0].memory.scarce + users[1].memory.scarce == 0)
        REQUIRE(memcmp(first, second, 12 * (size_t)users[0].info.vertex_count) == 0, "what is kept changes nothing");
    free(first);
    free(second);
}

static void show(user users[2], int32_t argument, const uint8_t *options)
{
    int32_t clip = argument % (users[0].info.clip_count + 1), level = options[2] % (users[0].info.level_count + 1) - 1;
    double seconds = ((int8_t)argument + 0.125 * options[3]) / 16.0;
    ath_wrap wrap = (ath_wrap)(options[4] % 4);
    float *first = shown(users, clip, seconds, wrap, level, options[5]);
    float *second = shown(users + 1, clip, seconds, wrap, level, options[5]);
    compare(users, first, second);
}

static void show_matrices(user *u, int32_t argument)
{
    int32_t nodes = 0, exact = 0, level = u->info.level_count - 1, shown = -1;
    for (int32_t i = 0; i <= level; i++) {
        int32_t own_nodes, own_exact;
        ath_cut_size(ath_player_file(u->player), i, NULL, &own_nodes, &own_exact);
        nodes = ath_max(nodes, own_nodes);
        exact = ath_max(exact, own_exact);
    }
    float *matrices = fuzz_memory(12 * sizeof(float) * (size_t)nodes, 0);
    float *stems = fuzz_memory(3 * sizeof(float) * (size_t)exact, 0);
    int result = ath_player_matrices(u->player, 0, argument / 16.0, ATH_AS_MARKED, level, matrices, stems, &shown);
    REQUIRE(is_error(result) || (shown >= 0 && shown <= level), "a level is shown that was asked for");
    free(stems);
    free(matrices);
}

static void go_ahead(user *u, int32_t argument)
{
    int result = ath_player_ahead(u->player, 1000 * argument);
    REQUIRE(result == ATH_OK || result == ATH_MORE || is_error(result), "preparing ahead gives its codes");
}

/* A job begins, goes on, or is taken over, done or not. */
static void work(user *u, int32_t argument)
{
    ath_player_job **job = u->jobs + argument % JOBS;
    if (!*job)
        *job = ath_player_begin(u->player);
    else if (argument & 4)
        ath_player_run(*job, 1000 * argument);
    else {
        ath_player_end(u->player, *job);
        *job = NULL;
    }
}

/* Corners of triangles or lines; *count of them. */
static uint32_t *corners(user *u, int is_lines, ath_order order, size_t *count)
{
    int (*read)(ath_player *, ath_order, uint32_t *, size_t *) = is_lines ? ath_player_lines : ath_player_triangles;
    size_t again, size = is_lines ? 2 : 3;
    int result = read(u->player, order, NULL, count);
    REQUIRE(result == ATH_OK || is_error(result) || result == ATH_LIMIT_EXCEEDED, "topology gives its codes");
    if (result != ATH_OK || *count * size * 4 > MOST_MEMORY) return NULL;
    *count *= size;
    uint32_t *found = fuzz_memory(*count * sizeof *found, 0);
    if (read(u->player, order, found, &again) != ATH_OK) {
        free(found);
        return NULL;
    }
    REQUIRE(again * size == *count, "topology is counted alike");
    for (size_t i = 0; i < *count; i++) REQUIRE(found[i] < (uint32_t)u->info.vertex_count, "corners are vertices");
    return found;
}

static void shade(user *u, int32_t argument)
{
    size_t count, vertices = (size_t)u->info.vertex_count;
    uint32_t *triangles = corners(u, 0, (ath_order)(argument & 1), &count);
    if (triangles) {
        float *xyz = fuzz_memory(12 * vertices, 0x3f), *normals = fuzz_memory(12 * vertices, 0xa5);
        float *tangents = fuzz_memory(16 * vertices, 0xa5);
        for (size_t i = 0; i < 3 * vertices; i++) xyz[i] = (float)(i * i % 17);
        ath_player_normals(triangles, count / 3, xyz, 12, u->info.vertex_count, normals);
        ath_player_tangents(triangles, count / 3, xyz, 12, xyz, 12, normals, u->info.vertex_count, tangents);
        for (size_t i = 0; i < 3 * vertices; i++)
            REQUIRE(normals[i] >= -1.001f && normals[i] <= 1.001f, "normals are of length 1 or 0");
        free(tangents);
        free(normals);
        free(xyz);
    }
    free(triangles);
    free(corners(u, 1, (ath_order)(argument & 1), &count));
}

/* A wind over all clips, each in one of its own, and numbers that name none. */
static float *in_wind(user *u, int32_t argument, const uint8_t *options)
{
    int32_t clips = u->info.clip_count;
    ath_wind *winds = fuzz_memory((size_t)clips * sizeof *winds, 0);
    float *xyz = fuzz_memory(12 * (size_t)u->info.vertex_count, 0);
    for (int32_t i = 0; i < clips; i++) {
        winds[i].strength = (i + options[3]) % 5 ? (double)((i * 7 + argument) % 11) : NAN;
        winds[i].heading = 45.0 * ((i + argument) % 9) - 90.0;
    }
    int result = ath_player_wind_positions(u->player, winds, argument / 8.0, 3.0 * options[2], options[5] / 32.0,
                                           (ath_wrap)(options[4] % 4), argument % (u->info.level_count + 1) - 1,
                                           ATH_SOURCE_ORDER, xyz, 12);
    free(winds);
    if (result == ATH_OK || result == ATH_HELD) return xyz;
    REQUIRE(is_error(result), "winds give their codes");
    free(xyz);
    return NULL;
}

static void show_alike(user users[2], float *(*of)(user *, int32_t, const uint8_t *), int32_t argument,
                       const uint8_t *options)
{
    float *first = of(users, argument, options);
    compare(users, first, of(users + 1, argument, options));
}

static void call(user users[2], int32_t which, int32_t argument, const uint8_t *options)
{
    if (which == 0 || which == 1) show(users, argument, options);
    if (which == 7) show_alike(users, in_wind, argument, options);
    for (int32_t i = 0; i < 2; i++) {
        if (which == 2) show_matrices(users + i, argument);
        if (which == 3 || which == 4) go_ahead(users + i, argument);
        if (which == 5) work(users + i, argument);
        if (which == 6) shade(users + i, argument);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < OPTIONS) return 0;
    const uint8_t *options = data + size - OPTIONS;
    size_t length = size - OPTIONS;
    uint32_t count, vertices = 0;
    user users[2];
    uint8_t *file = fuzz_copy(data, length);
    fuzz_repair(file, length);
    free(fuzz_chunks(file, length, &count, &vertices));
    if (vertices > FUZZ_MESH_VERTICES) vertices = 0;
    for (int32_t i = 0; i < 2; i++) open_player(users + i, file, length, vertices, options, i);
    if (users[0].player && users[1].player) {
        for (int32_t i = 6; i + 1 < OPTIONS; i += 2) call(users, options[i] % CALLS, options[i + 1], options);
        for (int32_t which = 0; which < CALLS; which++) call(users, which, options[which], options);
    }
    for (int32_t i = 0; i < 2; i++) close_player(users + i);
    free(file);
    return 0;
}
