#include "cross_spectrum.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

#define SIGNIFICAND_BITS 23
#define EXPONENT_OF_ONE 127

static uint32_t toBits(float x) {
  uint32_t bits;
  memcpy(&bits, &x, sizeof(bits));
  return bits;
}

static float fromBits(uint32_t bits) {
  float x;
  memcpy(&x, &bits, sizeof(x));
  return x;
}

/** The mantissa of @p x in [0.5, 1), its exponent added to @p exponent; for 0 < x <= FLT_MAX. */
static float splitFloat(float x, int *exponent) {
  if (x < FLT_MIN) {  // denormal
    x *= 0x1p24f;
    *exponent -= 24;
  }
  const uint32_t bits = toBits(x);
  *exponent += (int)(bits >> SIGNIFICAND_BITS) - (EXPONENT_OF_ONE - 1);
  return fromBits((bits & 0x007fffffu) | ((EXPONENT_OF_ONE - 1u) << SIGNIFICAND_BITS));
}

/** x 2^exponent, at most FLT_MAX; for x in [0.7, 1.42). */
static float joinFloat(float x, int exponent) {
  if (exponent >= 1 - EXPONENT_OF_ONE && exponent <= EXPONENT_OF_ONE) {
    return x * fromBits((uint32_t)(exponent + EXPONENT_OF_ONE) << SIGNIFICAND_BITS);
  }
  const float joined = ldexpf(x, exponent);
  return joined > FLT_MAX ? FLT_MAX : joined;
}

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
    mantissa *= splitFloat(p > FLT_MAX ? FLT_MAX : p, &exponent);
    if (mantissa < 0.5f) {  // the product of two numbers in [0.5, 1) is at least 0.25
      mantissa *= 2.0f;
      exponent--;
    }
  }
  if (zero) {
    return 0.0f;
  }
  const int odd = exponent & 1;
  return joinFloat(sqrtf(odd ? 2.0f * mantissa : mantissa), (exponent - odd) / 2);
}

void cascadedCrossSpectrum(const float *power, const uint16_t *groups, uint16_t groupCount, float *feature) {
  for (uint16_t g = 0; g < groupCount; g++) {
    feature[g] = crossSpectrum(power, groups[g]);
    power += groups[g];
  }
}
