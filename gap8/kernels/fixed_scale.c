#include "fixed_scale.h"

#include <string.h>

/**
 * log2 of a positive, normal float: its exponent, and of its mantissa m in [0.7, 1.41] the
 * series of 2 atanh((m - 1) / (m + 1)) / ln 2. Its own series: naturalLogarithm in start_up_math.h has other terms,
 * and so other bits.
 */
static float log2OfNormal(float x) {
  uint32_t bits;
  memcpy(&bits, &x, sizeof(bits));
  int32_t exponent = (int32_t)(bits >> 23) - 127;
  bits = (bits & 0x007fffffu) | 0x3f800000u;
  float mantissa;
  memcpy(&mantissa, &bits, sizeof(mantissa));
  if (mantissa > 1.41421356f) {
    mantissa *= 0.5f;
    exponent++;
  }
  const float z = (mantissa - 1.0f) / (mantissa + 1.0f);
  const float square = z * z;
  const float series = ((square * 0.142857143f + 0.2f) * square + 0.333333333f) * square + 1.0f;
  return (float)exponent + 2.88539008f * z * series;
}

void fixedScaleApply(const fixedScale_t *scale, const float *features, float *x) {
  for (int32_t i = 0; i < scale->columns; i++) {
    float value = features[i] > FIXED_SCALE_SMALLEST ? features[i] : FIXED_SCALE_SMALLEST;
    value = value < FIXED_SCALE_LARGEST ? value : FIXED_SCALE_LARGEST;
    const float deviations = (log2OfNormal(value) - scale->mean[i]) * scale->inverseDeviation[i];
    const float above = deviations < -FIXED_SCALE_LIMIT ? -FIXED_SCALE_LIMIT : deviations;
    x[i] = above > FIXED_SCALE_LIMIT ? FIXED_SCALE_LIMIT : above;
  }
}
