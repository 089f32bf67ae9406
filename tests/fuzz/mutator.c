/* Mutations that know chunks: what libFuzzer makes of one chunk's bytes is put in its place, and the table says so. */
#include "harness.h"

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned int seed);

/* The chunk that is number `which`: where it begins; 0: there is none. */
static size_t find_chunk(const uint8_t *data, size_t size, uint32_t which)
{
    size_t at = fuzz_chunks_at(data, size);
    for (uint32_t i = 0; at > 0 && i <= which; i++) {
        size_t length = fuzz_u32(data + HEADER + (size_t)ENTRY * i + 8);
        if (length > size - at) return 0;
        if (i < which) at += length;
    }
    return at;
}

static size_t mutate_chunk(uint8_t *data, size_t size, size_t most, uint32_t which)
{
    size_t at = find_chunk(data, size - OPTIONS, which);
    if (at == 0) return LLVMFuzzerMutate(data, size, most);
    uint8_t *entry = data + HEADER + (size_t)ENTRY * which;
    size_t length = fuzz_u32(entry + 8), end = at + length, tail = size - end, room = length + (most - size);
    uint8_t *chunk = fuzz_memory(room + 1, 0), *behind = fuzz_copy(data + end, tail);
    memcpy(chunk, data + at, length);
    length = LLVMFuzzerMutate(chunk, length, room);
    memcpy(data + at, chunk, length);
    memcpy(data + at + length, behind, tail);
    fuzz_put_u32(entry + 8, (uint32_t)length);
    free(chunk);
    free(behind);
    return at + length + tail;
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned int seed)
{
    size_t front = size > OPTIONS ? fuzz_chunks_at(data, size - OPTIONS) : 0;
    uint32_t count = front > 0 ? fuzz_u32(data + CHUNK_COUNT_AT) : 0, way = seed % 8, which = seed / 8;
    if (count == 0 || way == 0) return LLVMFuzzerMutate(data, size, most);
    if (way > 2) return mutate_chunk(data, size, most, which % count);
    if (way == 1)
        LLVMFuzzerMutate(data + size - OPTIONS, OPTIONS, OPTIONS);
    else
        LLVMFuzzerMutate(data + 4 * (which % (front / 4)), 4, 4);
    return size;
}
