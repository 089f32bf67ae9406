/* Mutations that know chunks: one chunk's bytes, or those of the front, become what libFuzzer makes of them. The lengths
 * of chunks stay as the front has them. */
#include "harness.h"

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned int seed);

static void mutate_chunk(uint8_t *data, size_t size, uint32_t which)
{
    uint32_t count = 0, vertices = 0;
    ath_chunk *chunks = fuzz_chunks(data, size, &count, &vertices);
    const ath_chunk *chunk = chunks && count > 0 ? chunks + which % count : NULL;
    if (chunk && chunk->length > 0 && chunk->offset + chunk->length <= size)
        LLVMFuzzerMutate(data + chunk->offset, chunk->length, chunk->length);
    free(chunks);
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned int seed)
{
    size_t front = size > OPTIONS ? fuzz_chunks_at(data, size - OPTIONS) : 0;
    uint32_t way = seed % 8, which = seed / 8;
    if (front == 0 || way == 0) return LLVMFuzzerMutate(data, size, most);
    if (way > 2)
        mutate_chunk(data, size - OPTIONS, which);
    else if (way == 1)
        LLVMFuzzerMutate(data + size - OPTIONS, OPTIONS, OPTIONS);
    else
        LLVMFuzzerMutate(data + 4 * (which % (front / 4)), 4, 4);
    return size;
}
