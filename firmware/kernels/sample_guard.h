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

/** Where the unit is known, to what a sensor can say: a longer number would be remembered for half a minute. */
#define ACC_LIMIT 240.0f  ///< m/s^2, full scale of the IMU: 24 g
#define RATE_LIMIT 40.0f  ///< rad/s, full scale of the IMU: 2000 degrees/s
#define PWM_LIMIT 65535.0f
#define AXIS_LIMIT 1.0f  ///< of a unit vector's components

/** @p x limited to @p low .. @p high; all finite. */
static inline float clampFloat(float x, float low, float high) { return x < low ? low : (x > high ? high : x); }

/**
 * @p x, clamped to +-@p limit, or the last finite sample when @p x is NaN or infinite.
 * @param held  the last finite sample; the caller sets the value for "none yet"
 * @return the sample to use, which is also kept in @p held
 */
static inline float guardWithin(float x, float limit, float *held) {
  if (fabsf(x) <= limit) {  // nearly always: one comparison says all
    *held = x;
  } else if (isfinite(x)) {
    *held = x > 0.0f ? limit : -limit;
  }
  return *held;
}

/** The same for a sample of any unit. */
static inline float guardSample(float x, float *held) { return guardWithin(x, SAMPLE_LIMIT, held); }

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
