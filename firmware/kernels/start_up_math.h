/**
 * @file start_up_math.h
 * The few functions that kernels need once, when they are set up. A C library's differ in the last
 * bit from one compiler to the next; these are the same wherever float is IEEE 754, so that a drone
 * gives the desktop's results to the last bit. Within 3 units in the last place.
 */
#pragma once

#include <stdint.h>
#include <string.h>

/** sin x and cos x for x in 0 .. pi / 4. */
static inline void sineCosine(float x, float *sine, float *cosine) {
  const float y = x * x;
  const float s = 1.0f / 6.0f - y * (1.0f / 120.0f - y * (1.0f / 5040.0f - y * (1.0f / 362880.0f)));
  const float c = 1.0f / 24.0f - y * (1.0f / 720.0f - y * (1.0f / 40320.0f - y * (1.0f / 3628800.0f)));
  *sine = x - x * y * s;
  *cosine = 1.0f - y * (0.5f - y * c);
}

/** 2^exponent for exponent in -126 .. 127. */
static inline float powerOfTwo(int32_t exponent) {
  const uint32_t bits = (uint32_t)(exponent + 127) << 23;
  float power;
  memcpy(&power, &bits, sizeof(power));
  return power;
}

#define LOG_2_HIGH 0.693145751953125f  // 16 bits of log 2: exact times any exponent
#define LOG_2_LOW 1.428606765330187e-06f

/** log x for a normal x > 0. */
static inline float naturalLogarithm(float x) {
  uint32_t bits;
  memcpy(&bits, &x, sizeof(bits));
  int32_t exponent = (int32_t)(bits >> 23) - 127;
  float mantissa = x * powerOfTwo(-exponent / 2) * powerOfTwo(-exponent - -exponent / 2);
  if (mantissa > 1.41421356f) {
    mantissa *= 0.5f;
    exponent++;
  }
  const float s = (mantissa - 1.0f) / (mantissa + 1.0f);
  const float y = s * s;
  const float tail = y * (1.0f / 3.0f + y * (1.0f / 5.0f + y * (1.0f / 7.0f + y * (1.0f / 9.0f))));
  return (float)exponent * LOG_2_HIGH + ((float)exponent * LOG_2_LOW + 2.0f * s * (1.0f + tail));
}

/** e^x - 1, at most 2^127; exact to the last digits for small x too. */
static inline float exponentialLessOne(float x) {
  const float limited = x < -40.0f ? -40.0f : (x > 88.0f ? 88.0f : x);
  const float scaled = limited * 1.44269504f;
  const int32_t exponent = (int32_t)(scaled < 0.0f ? scaled - 0.5f : scaled + 0.5f);
  const float rest = (limited - (float)exponent * LOG_2_HIGH) - (float)exponent * LOG_2_LOW;
  float series = 1.0f;  // of 2 (e^rest - 1 - rest) / rest^2
  for (int32_t i = 9; i >= 3; i--) {
    series = 1.0f + rest / (float)i * series;
  }
  const float less = rest + 0.5f * rest * rest * series;
  if (exponent == 0) {
    return less;
  }
  const float power = powerOfTwo(exponent);
  return power * less + (power - 1.0f);
}
