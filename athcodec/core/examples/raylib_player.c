/* Plays an .ath file in raylib: the level of detail follows the distance, and only the ranges that it needs are fetched.
 *
 *     raylib_player FILE [DISTANCE [FRAMES PICTURE]]      in heights of the plant; the keys up and down change it */
#define ATH_PLAYER_IMPLEMENTATION
#include <ath_player.h>
#include <raylib.h>
#include <rlgl.h>
#include <stdio.h>
#include <zstd.h>

static FILE *source; /* the server's file; `bytes` has room for all of it, since bytes that were fed stay in place */
static uint8_t *bytes;
static size_t source_size, fetched;

static void *allocate(size_t count, size_t size)
{
    void *memory = calloc(count + 1, size);
    if (!memory) TraceLog(LOG_FATAL, "there is too little memory for this file"); /* which ends the program */
    return memory;
}

/* Gets a range, as a request over HTTP would. A file may name bytes that it does not have. */
static int fetch(uint64_t offset, uint64_t size)
{
    if (offset > source_size || size > source_size - offset || fseek(source, (long)offset, SEEK_SET) != 0) return 0;
    fetched += (size_t)size;
    return fread(bytes + offset, 1, (size_t)size, source) == size;
}

static ath_player *open_player(const char *path)
{
    ath_player *player;
    size_t there = 0, front = 0, memory;
    if (!(source = fopen(path, "rb")) || fseek(source, 0, SEEK_END) != 0)
        TraceLog(LOG_FATAL, "%s cannot be read", path);
    bytes = allocate(source_size = (size_t)ftell(source), 1);
    while (ath_front(bytes, there, NULL, &front, &memory, NULL) == ATH_MISSING && fetch(there, front - there))
        there = front;
    int result = ath_player_open(&player, bytes, there, NULL, NULL);
    if (result != ATH_OK) TraceLog(LOG_FATAL, "%s: %s", path, ath_result_name(result));
    return player;
}

/* Fetches what is missing of the segments 0 to last at a level, or of the named arrays (level -1). */
static void fetch_missing(ath_player *player, int32_t last, int32_t level)
{
    const ath_file *file = ath_player_file(player);
    ath_range range;
    while ((level < 0 ? ath_array_ranges(file, &range, 1) : ath_ranges(file, level, 0, last, 0, &range, 1)) > 0
           && fetch(range.offset, range.size))
        ath_player_feed(player, bytes + range.offset, range.offset, (size_t)range.size);
}

/* Reads the array "uv", if it has two floats for each vertex. */
static void read_uv(const ath_file *file, size_t vertices, float *uv)
{
    ath_array array;
    if (ath_array_of(file, ath_array_named(file, "uv"), &array, NULL) != ATH_OK) return;
    if (array.kind != ATH_FLOATS || array.item_bytes != 4 || array.bytes != vertices * 8) return;
    void *unpacked = allocate(vertices, 8);
    if (ZSTD_decompress(unpacked, vertices * 8, array.packed, array.packed_bytes) == array.bytes)
        ath_array_elements(&array, unpacked, uv);
    free(unpacked);
}

int main(int argc, char **argv)
{
    ath_player *player = open_player(argc > 1 ? argv[1] : "FILE");
    const ath_file *file = ath_player_file(player);
    ath_info info;
    int32_t last = ath_clips(file)->segment_count - 1, level = 0;
    size_t count = 0;
    ath_get_info(file, &info);
    if (ath_player_triangles(player, ATH_SOURCE_ORDER, NULL, &count) != ATH_OK || count == 0 || count > 1 << 25)
        TraceLog(LOG_FATAL, "%s has no faces that raylib can draw; ath_player_lines gives lines", argv[1]);
    size_t vertices = (size_t)info.vertex_count, corners = 3 * count;
    float *xyz = allocate(vertices, 12), *normals = allocate(vertices, 12), *uv = allocate(vertices, 8);
    uint32_t *triangles = allocate(corners, 4);
    ath_player_triangles(player, ATH_SOURCE_ORDER, triangles, &count);
    fetch_missing(player, last, -1);
    read_uv(file, vertices, uv);

    InitWindow(960, 720, argv[1]);
    rlDisableBackfaceCulling();
    Mesh mesh = {.vertexCount = (int)corners, .triangleCount = (int)count}; /* raylib's indices have only 16 bits */
    mesh.vertices = allocate(corners, 12), mesh.normals = allocate(corners, 12), mesh.texcoords = allocate(corners, 8);
    for (size_t i = 0; i < corners; i++) memcpy(mesh.texcoords + 2 * i, uv + 2 * (size_t)triangles[i], 8);
    UploadMesh(&mesh, true);
    Model model = LoadModelFromMesh(mesh);
    Image image = GenImageChecked(8, 8, 1, 1, (Color){120, 200, 60, 255}, (Color){70, 130, 40, 255});
    model.materials[0].maps[0].texture = LoadTextureFromImage(image);
    BoundingBox box = {{0, 0, 0}, {0, 1, 0}}; /* of the first frame, at level 0, from then on */
    double away = argc > 2 ? atof(argv[2]) : 1.5;
    for (int frame = 0; !WindowShouldClose() && (argc < 5 || frame < atoi(argv[3])); frame++) {
        away *= IsKeyDown(KEY_UP) ? 0.98 : IsKeyDown(KEY_DOWN) ? 1.02 : 1.0;
        float middle = (box.min.y + box.max.y) / 2, distance = (float)away * (box.max.y - box.min.y);
        if (frame > 0) level = ath_level_for(file, 0, last, ATH_P99, distance, 0.8, GetScreenHeight(), 1.0);
        fetch_missing(player, last, level);
        int result = ath_player_positions(player, 0, frame / 60.0, ATH_LOOP, level, ATH_SOURCE_ORDER, xyz, 12);
        if (result != ATH_OK && result != ATH_HELD) TraceLog(LOG_FATAL, "frame %d: %s", frame, ath_result_name(result));
        ath_player_ahead(player, ATH_PLAYER_BUDGET);
        ath_player_normals(triangles, count, xyz, 12, info.vertex_count, normals);
        for (size_t i = 0; i < corners; i++) {
            memcpy(mesh.vertices + 3 * i, xyz + 3 * (size_t)triangles[i], 12);
            memcpy(mesh.normals + 3 * i, normals + 3 * (size_t)triangles[i], 12);
        }
        UpdateMeshBuffer(mesh, 0, mesh.vertices, (int)corners * 12, 0);
        UpdateMeshBuffer(mesh, 2, mesh.normals, (int)corners * 12, 0);
        if (frame == 0) box = GetMeshBoundingBox(mesh);
        BeginDrawing();
        ClearBackground((Color){225, 235, 240, 255});
        BeginMode3D((Camera){{0, middle, distance}, {0, middle, 0}, {0, 1, 0}, 45.8f, CAMERA_PERSPECTIVE});
        DrawModel(model, (Vector3){0, 0, 0}, 1.0f, (Color){255, 255, 255, 255});
        EndMode3D();
        EndDrawing();
    }
    printf("level %d of %d, %zu of %zu bytes\n", (int)level, (int)info.level_count, fetched, source_size);
    return argc > 4 && !ExportImage(LoadImageFromScreen(), argv[4]);
}
