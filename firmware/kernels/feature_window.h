/**
 * @file feature_window.h
 * Normalisation of the fused features: per window, as in the authors' data, and streaming.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: streamingZScore_t alone, 40 bytes a column.
 * Cost: two divisions a value and one square root a column, of a window; one of each a value, streaming.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A streaming deviation below this counts as zero: its square leaves float. */
#define STREAMING_STD_FLOOR 1e-17f

/**
 * Each column of a window to mean 0 and population standard deviation 1.
 * @param features  window rows of `columns` values; NaN and infinite ones hold the last finite one
 * @param out       as many values; may be @p features itself. A constant column gives 0
 */
void zScoreWindow(const float *features, uint16_t window, uint16_t columns, float *out);

/** An exponentially weighted mean whose weights are normalised by their sum. */
typedef struct {
  float rate;  ///< 1 - e^(-1 / timeConstant)
  float mean;
  float low;        ///< what rounding lost of it: mean - low is exact to twice float's digits
  float weight;     ///< sum of the weights of all samples, that of the newest being 1
  float weightLow;  ///< what rounding lost of it
  float gain;       ///< weight of the newest sample in the mean
  uint32_t settle;  ///< samples until the gain is `rate` for good
} exponentialMean_t;

/** Sets a mean up; @p timeConstant, in which a weight falls by e, must be positive, in samples. */
void exponentialMeanInit(exponentialMean_t *self, float timeConstant);

/** Takes a finite sample and returns its deviation from the mean before it, 0 for the first. */
float exponentialMeanStep(exponentialMean_t *self, float x);

/** State of one column's streaming z-score. */
typedef struct {
  exponentialMean_t mean;
  float held;  ///< the last finite sample
  float variance;
  bool started;
} streamingZScore_t;

/** Sets a column up; @p timeConstant must be positive, in samples. */
void streamingZScoreInit(streamingZScore_t *self, float timeConstant);

/**
 * Takes a sample and returns it against the weighted mean and deviation up to and with it.
 * @return 0 before the first finite sample and while the deviation is below STREAMING_STD_FLOOR
 */
float streamingZScoreStep(streamingZScore_t *self, float x);

#ifdef __cplusplus
}
#endif
