// What every inner loop here is made of: a unit of inputs times a unit of weights. With
// XPULP a unit is four int8 in a register and their dot product one instruction; elsewhere
// it is a single value.
#pragma once

#include <stdint.h>

#include "xpulp.h"

#define ALWAYS_INLINE static inline __attribute__((always_inline))

#if AIRTOUCH_XPULP

enum { UNIT = 4 };

ALWAYS_INLINE int32_t loadUnit(const int8_t *p) {
  return xpulpLoad4(p);
}

ALWAYS_INLINE int32_t multiplyAdd(int32_t x, int32_t w, int32_t sum) {
  return xpulpDot4(x, w, sum);
}

#else

enum { UNIT = 1 };

ALWAYS_INLINE int32_t loadUnit(const int8_t *p) {
  return *p;
}

ALWAYS_INLINE int32_t multiplyAdd(int32_t x, int32_t w, int32_t sum) {
  return sum + x * w;
}

#endif
