/* Input and output that fails on command: stands between a program and the C library (LD_PRELOAD) and lets the n-th call
 * on a file below a folder fail, once or from then on. _io_errors.py arms it. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>
#include <unistd.h>

static char folder[PATH_MAX];
static atomic_long calls, fails_at = -1;
static atomic_int fired;
static int error_number = EIO, lasts;

/* From now on the n-th call fails, counted from 1 (0: none does), with an error; `on`: and all after it. */
void faulty_arm(const char *below, long n, int error, int on)
{
    snprintf(folder, sizeof folder, "%s", below);
    error_number = error;
    lasts = on;
    atomic_store(&calls, 0);
    atomic_store(&fired, 0);
    atomic_store(&fails_at, n);
}

long faulty_calls(void) { return atomic_load(&calls); }
int faulty_fired(void) { return atomic_load(&fired); }

__attribute__((constructor)) static void from_environment(void)
{
    const char *below = getenv("FAULTY_FOLDER"), *n = getenv("FAULTY_CALL");
    if (below && n) faulty_arm(below, atol(n), EIO, 0);
}

static int is_below(const char *path) { return !strncmp(path, folder, strlen(folder)); }

static int fails(void)
{
    long at = atomic_load(&fails_at), now = atomic_fetch_add(&calls, 1) + 1;
    if (at < 1 || (lasts ? now < at : now != at)) return 0;
    atomic_store(&fired, 1);
    errno = error_number;
    return 1;
}

static int file_fails(int file)
{
    char link[40], path[PATH_MAX];
    int before = errno;
    if (!*folder) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    errno = before;
    if (length < 0) return 0;
    path[length] = 0;
    return is_below(path) && fails();
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define ON_FILE(type, name, parameters, ...)                                                                           \
    type name parameters                                                                                               \
    {                                                                                                                  \
        static __typeof__(&name) real;                                                                                 \
        if (!real) real = REAL(name);                                                                                  \
        return file_fails(file) ? -1 : real(__VA_ARGS__);                                                              \
    }

ON_FILE(ssize_t, read, (int file, void *to, size_t size), file, to, size)
ON_FILE(ssize_t, pread, (int file, void *to, size_t size, off_t at), file, to, size, at)
ON_FILE(ssize_t, pread64, (int file, void *to, size_t size, off64_t at), file, to, size, at)
ON_FILE(ssize_t, write, (int file, const void *from, size_t size), file, from, size)
ON_FILE(ssize_t, pwrite, (int file, const void *from, size_t size, off_t at), file, from, size, at)
ON_FILE(ssize_t, pwrite64, (int file, const void *from, size_t size, off64_t at), file, from, size, at)
ON_FILE(ssize_t, writev, (int file, const struct iovec *from, int count), file, from, count)
ON_FILE(int, ftruncate, (int file, off_t size), file, size)
ON_FILE(int, ftruncate64, (int file, off64_t size), file, size)
ON_FILE(int, fsync, (int file), file)
ON_FILE(int, fdatasync, (int file), file)

int close(int file)
{
    static __typeof__(&close) real;
    if (!real) real = REAL(close);
    int failed = file_fails(file), error = errno, result = real(file);
    if (failed) errno = error;
    return failed ? -1 : result; /* closed all the same, as Linux does */
}

int rename(const char *from, const char *to)
{
    static __typeof__(&rename) real;
    if (!real) real = REAL(rename);
    return *folder && is_below(to) && fails() ? -1 : real(from, to);
}
