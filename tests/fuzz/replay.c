/* Stands in for libFuzzer where there is none: tries every file of the command line once. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static int try_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END) != 0) return 0;
    size_t size = (size_t)ftell(file);
    uint8_t *bytes = malloc(size > 0 ? size : 1);
    rewind(file);
    int whole = bytes && fread(bytes, 1, size, file) == size;
    if (whole) LLVMFuzzerTestOneInput(bytes, size);
    free(bytes);
    fclose(file);
    return whole;
}

int main(int count, char **words)
{
    for (int i = 1; i < count; i++)
        if (words[i][0] != '-' && !try_file(words[i])) {
            fprintf(stderr, "replay: %s: cannot be read\n", words[i]);
            return 2;
        }
    return 0;
}
