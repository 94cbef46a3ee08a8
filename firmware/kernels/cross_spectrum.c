#include "cross_spectrum.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

float crossSpectrum(const float *power, uint16_t axes) {
  float mantissa = 0.5f;  // with exponent 1: the number one
  int exponent = 1;
  bool zero = false;
  for (uint16_t i = 0; i < axes; i++) {
    const float p = power[i];
    if (isnan(p)) {
      return p;
    }
    if (p <= 0.0f) {
      zero = true;
      continue;
    }
    int shift = 0;
    mantissa *= frexpf(p > FLT_MAX ? FLT_MAX : p, &shift);
    exponent += shift;
    if (mantissa < 0.5f) {  // the product of two numbers in [0.5, 1) is at least 0.25
      mantissa *= 2.0f;
      exponent--;
    }
  }
  if (zero) {
    return 0.0f;
  }
  const int odd = exponent & 1;
  const float root = ldexpf(sqrtf(odd ? 2.0f * mantissa : mantissa), (exponent - odd) / 2);
  return root > FLT_MAX ? FLT_MAX : root;
}

void cascadedCrossSpectrum(const float *power, const uint16_t *groups, uint16_t groupCount, float *feature) {
  for (uint16_t g = 0; g < groupCount; g++) {
    feature[g] = crossSpectrum(power, groups[g]);
    power += groups[g];
  }
}
