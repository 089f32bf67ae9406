#define ATH_PLAYER_IMPLEMENTATION
#include "ath_player.h"
#include <stdio.h>

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) {
        FILE *source = fopen(argv[i], "rb");
        fseek(source, 0, SEEK_END);
        size_t size = (size_t)ftell(source), count = 0, lines = 0;
        uint8_t *bytes = malloc(size);
        rewind(source);
        size = fread(bytes, 1, size, source);
        fclose(source);
        ath_player *player;
        ath_info info;
        int result = ath_player_open(&player, bytes, size, NULL, NULL);
        printf("%d %d\n", i, result);
        if (result == ATH_OK) {
            const ath_file *file = ath_player_file(player);
            ath_get_info(file, &info);
            ath_player_set_budget(player, ATH_PLAYER_EXACT);
            size_t floats = 3 * (size_t)info.vertex_count;
            float *xyz = calloc(floats, 4), *normals = calloc(floats, 4);
            result = ath_player_triangles(player, ATH_SOURCE_ORDER, NULL, &count);
            uint32_t *triangles = calloc(3 * count + 1, 4);
            if (result == ATH_OK) ath_player_triangles(player, ATH_SOURCE_ORDER, triangles, &count);
            ath_player_lines(player, ATH_SOURCE_ORDER, NULL, &lines);
            uint32_t *edges = calloc(2 * lines + 1, 4);
            ath_player_lines(player, ATH_SOURCE_ORDER, edges, &lines);
            printf("%zu %08x %zu %08x\n", count, ath_crc32c(0, (uint8_t *)triangles, 12 * count), lines,
                   ath_crc32c(0, (uint8_t *)edges, 8 * lines));
            for (int32_t clip = 0; clip < info.clip_count && clip < 2; clip++)
                for (int32_t level = 0; level < info.level_count; level++)
                    for (int32_t step = 0; step < 3; step++) {
                        ath_player_moment moment;
                        double seconds = step * 0.37 * ath_clips(file)[clip].duration;
                        result = ath_player_show(player, clip, seconds, ATH_LOOP, level, &moment);
                        if (result == ATH_OK)
                            result = ath_positions(file, moment.segments, moment.segment_count, moment.frame,
                                                   ATH_SOURCE_ORDER, xyz, 12);
                        ath_player_normals(triangles, count, xyz, 12, info.vertex_count, normals);
                        if (result != ATH_OK)
                            printf("%d\n", result);
                        else
                            printf("%d %08x %08x\n", moment.level, ath_crc32c(0, (uint8_t *)xyz, 4 * floats),
                                   ath_crc32c(0, (uint8_t *)normals, 4 * floats));
                    }
            ath_player_share shares[] = {{0, 0, ATH_LOOP, 0.1, 0.75}, {info.clip_count - 1, -1, ATH_CLAMP, 0.2, 0.25}};
            result = ath_player_blended_positions(player, shares, 2, ATH_SOURCE_ORDER, xyz, 12);
            if (result != ATH_OK)
                printf("%d\n", result);
            else
                printf("%08x\n", ath_crc32c(0, (uint8_t *)xyz, 4 * floats));
            ath_fade fade = {0};
            ath_fade_to(&fade, 0, 0.0);
            ath_fade_to(&fade, info.level_count - 1, 0.4);
            result = ath_player_faded_positions(player, 0, 0.1, ATH_LOOP, &fade, ATH_SOURCE_ORDER, xyz, 12);
            if (result != ATH_OK)
                printf("%d\n", result);
            else
                printf("%08x\n", ath_crc32c(0, (uint8_t *)xyz, 4 * floats));
            free(xyz), free(normals), free(triangles), free(edges);
            ath_player_close(player);
        }
        free(bytes);
    }
    return 0;
}
