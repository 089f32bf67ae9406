/* Decodes files on whatever machine it is compiled for. It reads lines "FILE" or "FILE MESH" (positions of the host's mesh)
 * from standard input, and prints for each the items of spec/conformance.py that a player knows, as expected.txt has
 * them: open, rest, and every level that the file says it has. */
#include <ath.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_LENGTH = 4096 };

typedef struct {
    uint8_t *bytes;
    size_t size;
} contents;

static void *allocate(size_t size)
{
    void *memory = aligned_alloc(16, (size + 31) / 16 * 16);
    if (!memory) exit(3);
    return memory;
}

static contents read_all(const char *path)
{
    FILE *source = fopen(path, "rb");
    contents whole;
    if (!source || fseek(source, 0, SEEK_END) != 0) exit(4);
    whole.size = (size_t)ftell(source);
    whole.bytes = allocate(whole.size);
    rewind(source);
    if (fread(whole.bytes, 1, whole.size, source) != whole.size) exit(4);
    fclose(source);
    return whole;
}

static int is_big_endian(void)
{
    const uint16_t one = 1;
    uint8_t first;
    memcpy(&first, &one, 1);
    return first == 0;
}

static void turn_bytes(uint8_t *number, size_t size)
{
    for (size_t i = 0; i < size / 2; i++) {
        uint8_t byte = number[i];
        number[i] = number[size - 1 - i];
        number[size - 1 - i] = byte;
    }
}

/* CRC-32C of numbers as the format has them, low bytes first. */
static uint32_t checksum_of(uint32_t crc, void *numbers, size_t count, size_t size)
{
    if (is_big_endian())
        for (size_t i = 0; i < count; i++) turn_bytes((uint8_t *)numbers + i * size, size);
    return ath_crc32c(crc, numbers, count * size);
}

/* Every NaN becomes the quiet one. */
static void quieten(void *numbers, size_t count, size_t size)
{
    const uint64_t wide_quiet = 0x7ff8000000000000;
    const uint32_t quiet = 0x7fc00000;
    double *wide = numbers;
    float *narrow = numbers;
    for (size_t i = 0; i < count; i++)
        if (size == 8 && wide[i] != wide[i])
            memcpy(wide + i, &wide_quiet, 8);
        else if (size == 4 && narrow[i] != narrow[i])
            memcpy(narrow + i, &quiet, 4);
}

static void print(const char *item, int result, uint32_t crc)
{
    if (result == ATH_MISSING)
        printf(" %s=TRUNCATED", item);
    else if (result != ATH_OK)
        printf(" %s=%s", item, ath_result_name(result));
    else
        printf(" %s=%08lx", item, (unsigned long)crc);
}

static int refine(ath_file *file, int32_t level)
{
    size_t size;
    int result = ath_refine_size(file, level, &size, NULL);
    return result == ATH_OK ? ath_refine(file, level, allocate(size), size) : result;
}

static int show(const ath_file *file, const ath_info *info, const ath_segment *segment, int32_t frame, void *xyz)
{
    if (info->is_float64)
        return ath_positions_float64(file, &segment, 1, frame, ATH_SOURCE_ORDER, xyz, 3 * sizeof(double));
    return ath_positions(file, &segment, 1, frame, ATH_SOURCE_ORDER, xyz, 3 * sizeof(float));
}

static int decode_level(ath_file *file, const ath_info *info, int32_t level, uint32_t *crc)
{
    int result = level < info->level_count ? refine(file, level) : ATH_MISSING;
    if (result != ATH_OK) return result;
    size_t work_size = ath_work_size(file), size = ath_segment_size(file, level),
           count = 3 * (size_t)info->vertex_count;
    void *work = allocate(work_size), *memory = allocate(size), *xyz = allocate(count * sizeof(double));
    for (int32_t s = 0; result == ATH_OK && s < info->segment_count; s++) {
        result = ath_prepare(work, work_size, file, s, level, memory, size);
        int32_t end = ath_segment_start(file, s + 1);
        for (int32_t t = ath_segment_start(file, s); result == ATH_OK && t < end; t++) {
            result = show(file, info, memory, t, xyz);
            quieten(xyz, count, info->is_float64 ? 8 : 4);
            *crc = checksum_of(*crc, xyz, count, info->is_float64 ? 8 : 4);
        }
    }
    free(work), free(memory), free(xyz);
    return result;
}

static int read_rest(ath_file *file, const ath_info *info, uint32_t *crc)
{
    size_t count = 3 * (size_t)info->vertex_count, size = info->rest_is_float64 ? 8 : 4;
    void *xyz = allocate(count * size);
    int result = refine(file, 0); /* The rest pose is coded about the reference pose of the level. */
    if (result == ATH_OK) result = ath_read_rest(file, NULL);
    if (result == ATH_OK && size == 8) result = ath_rest_float64(file, ATH_SOURCE_ORDER, xyz, 3 * size);
    if (result == ATH_OK && size == 4) result = ath_rest(file, ATH_SOURCE_ORDER, xyz, 3 * size);
    if (result == ATH_OK) *crc = checksum_of(0, xyz, count, size);
    free(xyz);
    return result;
}

/* The file, where it opens. */
static ath_file *opened(contents data, const contents *mesh)
{
    size_t front, size;
    int result = ath_front(data.bytes, data.size, NULL, &front, &size, NULL);
    ath_file *file = result == ATH_OK ? allocate(size) : NULL;
    if (file) result = ath_open(file, size, data.bytes, data.size, NULL, NULL);
    if (result == ATH_MISSING && data.size == 0) result = ATH_NOT_AN_ATH_FILE; /* no more will come */
    if (result != ATH_OK) {
        print("open", result, 0);
        return NULL;
    }
    printf(" open=ok");
    if (mesh) result = ath_set_host_mesh(file, mesh->bytes, 12, (int32_t)(mesh->size / 12), NULL);
    size = ath_build_size(file);
    if (result == ATH_OK) result = ath_build(file, allocate(size), size);
    if (result != ATH_OK) print("build", result, 0);
    return result == ATH_OK ? file : NULL;
}

static void decode(const char *path, const char *mesh_path)
{
    contents data = read_all(path), mesh = {NULL, 0};
    if (mesh_path) mesh = read_all(mesh_path);
    if (is_big_endian())
        for (size_t i = 0; i + 4 <= mesh.size; i += 4) turn_bytes(mesh.bytes + i, 4);
    printf("%s", path);
    ath_file *file = opened(data, mesh_path ? &mesh : NULL);
    ath_info info;
    uint32_t crc = 0;
    if (file) {
        ath_get_info(file, &info);
        int result = read_rest(file, &info, &crc);
        print("rest", result, crc);
        for (int32_t level = 0; level < info.full_level_count; level++) {
            char item[16];
            crc = 0;
            result = decode_level(file, &info, level, &crc);
            snprintf(item, sizeof item, "%d", (int)level);
            print(item, result, crc);
        }
    }
    printf("\n");
    free(data.bytes), free(mesh.bytes);
}

int main(void)
{
    static char line[2 * PATH_LENGTH];
    while (fgets(line, sizeof line, stdin)) {
        char *path = strtok(line, " \n"), *mesh = strtok(NULL, " \n");
        if (path) decode(path, mesh);
    }
    return 0;
}
