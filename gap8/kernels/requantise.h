// From an int32 accumulator to an int8 activation: the one rounding of this project.
//
// gemmlowp's double rounding, as TensorFlow Lite Micro does it: a rounding, doubling
// high multiplication (ties up), then a rounding shift to the right (ties away from
// zero). Equal to tflite-micro to the last bit. Right shifts of negative numbers must be
// arithmetic, as they are on every target here.
#pragma once

#include <stdint.h>

// round(a * b / 2^31) for b >= 0. Ties up.
static inline int32_t roundingDoublingHighMultiply(int32_t a, int32_t b) {
  return (int32_t)(((int64_t)a * (int64_t)b + (1LL << 30)) >> 31);
}

// round(x / 2^exponent) for exponent 0 to 31. Ties away from zero.
static inline int32_t roundingShiftRight(int32_t x, int32_t exponent) {
  const int32_t mask = (int32_t)((1LL << exponent) - 1);
  const int32_t threshold = (mask >> 1) + (x < 0 ? 1 : 0);
  return (x >> exponent) + ((x & mask) > threshold ? 1 : 0);
}

// The activation of an accumulator. The product accumulator * 2^shift must fit
// in int32 for a positive shift, as it does for every layer that training makes.
static inline int8_t requantise(int32_t accumulator, int32_t multiplier, int32_t shift,
                                int32_t zeroPoint, int32_t min, int32_t max) {
  const int32_t left = shift > 0 ? shift : 0;
  const int32_t right = shift > 0 ? 0 : -shift;
  const int32_t scaled = (int32_t)((uint32_t)accumulator << left);
  int32_t value = roundingShiftRight(roundingDoublingHighMultiply(scaled, multiplier), right) + zeroPoint;
  value = value < min ? min : value;
  value = value > max ? max : value;
  return (int8_t)value;
}
