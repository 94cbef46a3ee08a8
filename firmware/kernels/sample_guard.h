/**
 * @file sample_guard.h
 * What every kernel does with samples that are not numbers: hold the last
 * finite one, count, clamp; and the compensated sum that they share.
 */
#pragma once

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/** Samples are clamped to this magnitude: no square or window sum then leaves float. */
#define SAMPLE_LIMIT 1e15f

/** @p x limited to @p low .. @p high; all finite. */
static inline float clampFloat(float x, float low, float high) {
  return x < low ? low : (x > high ? high : x);
}

/**
 * @p x, clamped to +-SAMPLE_LIMIT, or the last finite sample when @p x is NaN or infinite.
 * @param held  the last finite sample; the caller sets the value for "none yet"
 * @return the sample to use, which is also kept in @p held
 */
static inline float guardSample(float x, float *held) {
  if (fabsf(x) <= SAMPLE_LIMIT) {  // nearly always: one comparison says all
    *held = x;
  } else if (isfinite(x)) {
    *held = x > 0.0f ? SAMPLE_LIMIT : -SAMPLE_LIMIT;
  }
  return *held;
}

/**
 * Kahan's sum: adds @p term to @p sum and carries what rounding lost in @p low.
 * The exact sum is about sum - low. Needs a compiler without -ffast-math.
 */
static inline void addCompensated(float *sum, float *low, float term) {
  const float t = term - *low;
  const float s = *sum + t;
  *low = (s - *sum) - t;
  *sum = s;
}
