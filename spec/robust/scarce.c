/* NumPy's memory that runs out on command: stands between NumPy and the allocator of its arrays (NEP 49), in all
 * threads, and lets the n-th request fail, once. load.py installs it and arms it around each call that it tests. */
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

typedef struct { /* PyDataMem_Handler of numpy/ndarraytypes.h, version 1 */
    char name[127];
    uint8_t version;
    void *context;
    void *(*take)(void *, size_t);
    void *(*take_zeros)(void *, size_t, size_t);
    void *(*resize)(void *, void *, size_t);
    void (*give)(void *, void *, size_t);
} handler;

static handler before;
static atomic_long left = -1; /* requests until the one that fails; below 1: none does */

static int fails(void) { return left > 0 && atomic_fetch_sub(&left, 1) == 1; }

static void *take(void *context, size_t size) { return fails() ? NULL : before.take(context, size); }

static void *take_zeros(void *context, size_t count, size_t size)
{
    return fails() ? NULL : before.take_zeros(context, count, size);
}

static void *resize(void *context, void *memory, size_t size)
{
    return fails() ? NULL : before.resize(context, memory, size);
}

/* 0: another version of the handler than this one knows. */
int scarce_install(handler *current)
{
    if (current->version != 1) return 0;
    before = *current;
    current->take = take;
    current->take_zeros = take_zeros;
    current->resize = resize;
    return 1;
}

/* From now on the n-th request fails, counted from 1; 0: none does. Returns whether one has failed since the last
 * call. */
int scarce_arm(long n) { return atomic_exchange(&left, n > 0 ? n : -1) == 0; }
