/**
 * @file fixed_scale.h
 * Fused features as inputs that do not depend on other samples.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: pure functions without state: any number at once.
 * Memory: none.
 * Cost: one division and a short series a column.
 */
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FIXED_SCALE_MAX_COLUMNS = 8 };

/**
 * How the fused features of a sample become inputs that do not depend on other samples:
 * x = clip((log2(feature) - mean) * inverseDeviation), column by column.
 */
typedef struct {
  int32_t columns;
  float mean[FIXED_SCALE_MAX_COLUMNS];
  float inverseDeviation[FIXED_SCALE_MAX_COLUMNS];
} fixedScale_t;

#define FIXED_SCALE_SMALLEST 9.094947017729282e-13f  // 2^-40: a smaller feature counts as this
#define FIXED_SCALE_LARGEST 3.0e38f                  // below FLT_MAX: a larger feature, infinity too, counts as this
#define FIXED_SCALE_LIMIT 4.0f                       // deviations at which inputs are clamped

/**
 * @brief The inputs of one sample from its features (both `columns` floats).
 *
 * The logarithm is a series within 4e-6 of log2, made of IEEE single operations alone, so
 * that every machine gives the same bits (build without contraction). One division a
 * column. NaN counts as FIXED_SCALE_SMALLEST; whoever calls resets the stream there.
 */
void fixedScaleApply(const fixedScale_t *scale, const float *features, float *x);

#ifdef __cplusplus
}
#endif
