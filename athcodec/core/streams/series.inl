/* Series over frames: times, and learned bases by their samples. Compiled once for each direction. */
#ifndef ATH_STREAMS_SERIES_INL
#define ATH_STREAMS_SERIES_INL

#include "bits/exact.inl"
#include "container/container.h"

static int code_times(ath_coder *coder, exact_model *model, int32_t frame_count, double *times)
{
    int32_t length = 0;
    exact_model_init(model);
    for (int32_t i = 0; i < frame_count; i++) {
        double predicted = i > 0 ? times[i - 1] : 0.0;
        if (i > 1) predicted = predicted + (times[i - 1] - times[i - 2]);
        if (!code_exact(coder, model, 1, predicted, &length, times + i)) return 0;
    }
    return 1;
}

static int code_temporal(ath_coder *coder, number_model *model, int32_t rank, int32_t frames, int32_t *basis)
{
    number_model_init(model);
    for (int32_t r = 0; r < rank; r++) {
        uint32_t mean = 1024;
        int32_t before = 0, slope = 0;
        for (int32_t t = 0; t < frames; t++) {
            int32_t *value = basis + (size_t)r * (size_t)frames + t;
            int32_t rest = code_signed(coder, model, mean, ENCODING ? *value - before - slope : 0);
            *value = before + slope + rest;
            if (!ENCODING && (*value < -ATH_MOST_SAMPLE || *value > ATH_MOST_SAMPLE)) return 0;
            slope = t > 0 ? *value - before : 0;
            before = *value;
            mean = averaged(mean, rest);
        }
    }
    return 1;
}

#endif
