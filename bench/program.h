/* What the benchmark's programs share: memory or the end, results that must be OK, quantiles. */
#ifndef BENCH_PROGRAM_H
#define BENCH_PROGRAM_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "ath.h"

static void *memory_of(size_t size)
{
    void *memory = aligned_alloc(64, (size + 64) & ~(size_t)63);
    if (!memory) {
        fprintf(stderr, "memory: got none, expected %zu bytes\n", size);
        exit(1);
    }
    return memory;
}

static void expect_ok(const char *what, int result)
{
    if (result == ATH_OK) return;
    fprintf(stderr, "%s: got %s, expected OK\n", what, ath_result_name(result));
    exit(1);
}

/* For files, which may be refused. */
static void expect_no_fault(const char *what, int result, const ath_fault_info *fault)
{
    char text[ATH_FAULT_TEXT];
    if (result == ATH_OK) return;
    ath_fault_text(fault, text, sizeof text);
    fprintf(stderr, "%s: %s: %s\n", what, ath_result_name(result), text);
    exit(1);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Builds what the layers of precision up to a level share; its bytes, which stay as long as the file. */
static size_t refine(ath_file *file, int32_t level)
{
    size_t size;
    ath_fault_info fault;
    expect_no_fault("ath_refine_size", ath_refine_size(file, level, &size, &fault), &fault);
    expect_ok("ath_refine", ath_refine(file, level, size > 0 ? memory_of(size) : NULL, size));
    return size;
}

/* The value below which `share` of them lie; sorts them. */
static double quantile(double *values, int count, double share)
{
    qsort(values, (size_t)count, sizeof *values, ascending);
    int at = (int)ceil(share * count) - 1;
    return values[at < 0 ? 0 : at];
}

#endif
