/**
 * @file requantise.h
 * From an int32 accumulator to an int8 activation: the rounding between int8 layers; inputs are
 * rounded by quantiseInput.
 *
 * gemmlowp's double rounding, as TensorFlow Lite Micro does it: a rounding, doubling
 * high multiplication (ties up), then a rounding shift to the right (ties away from
 * zero). Equal to tflite-micro to the last bit. Right shifts of negative numbers must be
 * arithmetic, as they are on every target here.
 */
#pragma once

#include <stdint.h>

#include "extensions.h"
#include "layer_int8.h"
#include "xpulp.h"

/** round(a * b / 2^31), ties up, for |a| < 2^29 and b >= 0. */
static inline int32_t roundingDoublingHighMultiply(int32_t a, int32_t b) {
  const int32_t halves = (int32_t)(((int64_t)(int32_t)((uint32_t)a << 2) * (int64_t)b) >> 32);  // one instruction
#if AIRTOUCH_XPULP
  return xpulpHalve(halves);
#else
  return (halves + 1) >> 1;
#endif
}

/** round(x / 2^exponent), ties away from zero, for exponent 1 to 31 and |x| < 2^30. */
static inline int32_t roundingShiftRight(int32_t x, int32_t exponent) {
  const int32_t towardsZero = x >> 31;  // -1 where x is negative: its ties go down
#if AIRTOUCH_XPULP
  return xpulpAddRoundShift(x, towardsZero, exponent);
#else
  return (x + towardsZero + (int32_t)(1u << (exponent - 1))) >> exponent;
#endif
}

#define QUANTISE_LIMIT 1024.0f  ///< steps: beyond int8 whatever the zero point, and well within int32

/** An input of a network: floor(x / scale + 0.5) + zeroPoint, clamped to int8; NaN counts as 0. */
static inline int8_t quantiseInput(float x, float scale, int32_t zeroPoint) {
  const float scaled = x / scale + 0.5f;
  if (!(scaled >= -QUANTISE_LIMIT && scaled <= QUANTISE_LIMIT)) {
    return (int8_t)(scaled > 0.0f ? INT8_MAX : (scaled < 0.0f ? INT8_MIN : zeroPoint));
  }
  const int32_t towardsZero = (int32_t)scaled;
  const int32_t q = towardsZero - ((float)towardsZero > scaled ? 1 : 0) + zeroPoint;
  return (int8_t)(q < INT8_MIN ? INT8_MIN : (q > INT8_MAX ? INT8_MAX : q));
}

/** Zero point and clamp of a layer's output, read once: bytes that a kernel writes might alias the layer. */
typedef struct {
  int32_t zeroPoint;
  int32_t min;
  int32_t max;
} outputRange_t;

static inline outputRange_t outputRange(const layerInt8_t *layer) {
  outputRange_t range;
  range.zeroPoint = layer->outputZeroPoint;
  range.min = layer->outputMin;
  range.max = layer->outputMax;
  return range;
}

/** What one output channel needs. */
typedef struct {
  int32_t multiplier;
  int32_t right;  ///< shift to the right
  outputRange_t range;
} requantiser_t;

static inline requantiser_t requantiser(const layerInt8_t *layer, int32_t channel, outputRange_t range) {
  requantiser_t r;
  r.multiplier = layer->multiplier[channel];
  r.right = -layer->shift[channel];
  r.range = range;
  return r;
}

/**
 * The activation of an accumulator. |accumulator|, and its product with a scale above one,
 * must be below 2^28, as in every layer that training makes and loading accepts. Never
 * falls with a rising accumulator, so that the largest of several may be taken before it.
 */
static inline int8_t requantise(requantiser_t r, int32_t accumulator) {
  int32_t value;
  if (LIKELY(r.right > 0)) {
    value = roundingShiftRight(roundingDoublingHighMultiply(accumulator, r.multiplier), r.right);
  } else {
    value = roundingDoublingHighMultiply((int32_t)((uint32_t)accumulator << -r.right), r.multiplier);
  }
  value += r.range.zeroPoint;
  value = value < r.range.min ? r.range.min : value;
  value = value > r.range.max ? r.range.max : value;
  return (int8_t)value;
}
