/**
 * @file dot_int8.h
 * What every inner loop here is made of: a unit of inputs times a unit of weights. With
 * XPULP a unit is four int8 in a register and their dot product one instruction; on a
 * Cortex-M4 it is the same four, their product two instructions and two to spread each
 * factor; elsewhere it is a single value.
 */
#pragma once

#include <stdint.h>

#include "extensions.h"
#include "xpulp.h"

#if AIRTOUCH_XPULP

enum { UNIT = 4 };

ALWAYS_INLINE int32_t loadUnit(const int8_t *p) { return xpulpLoad4(p); }

ALWAYS_INLINE int32_t multiplyAdd(int32_t x, int32_t w, int32_t sum) { return xpulpDot4(x, w, sum); }

#elif defined(__ARM_FEATURE_DSP) && AIRTOUCH_GNU

#include <string.h>

enum { UNIT = 4 };

ALWAYS_INLINE int32_t loadUnit(const int8_t *p) {
  int32_t four;
  memcpy(&four, p, sizeof(four));  // one load, aligned or not
  return four;
}

/** Bytes 0 and 2 as two int16 in a register. */
ALWAYS_INLINE int32_t evenBytes(int32_t four) {
  int32_t two;
  __asm__("sxtb16 %0, %1" : "=r"(two) : "r"(four));
  return two;
}

/** Bytes 1 and 3. */
ALWAYS_INLINE int32_t oddBytes(int32_t four) {
  int32_t two;
  __asm__("sxtb16 %0, %1, ror #8" : "=r"(two) : "r"(four));
  return two;
}

/** sum + a[0] b[0] + a[1] b[1], of int16 */
ALWAYS_INLINE int32_t multiplyAddTwo(int32_t a, int32_t b, int32_t sum) {
  int32_t more;
  __asm__("smlad %0, %1, %2, %3" : "=r"(more) : "r"(a), "r"(b), "r"(sum));
  return more;
}

ALWAYS_INLINE int32_t multiplyAdd(int32_t x, int32_t w, int32_t sum) {
  return multiplyAddTwo(oddBytes(x), oddBytes(w), multiplyAddTwo(evenBytes(x), evenBytes(w), sum));
}

#else

enum { UNIT = 1 };

ALWAYS_INLINE int32_t loadUnit(const int8_t *p) { return *p; }

ALWAYS_INLINE int32_t multiplyAdd(int32_t x, int32_t w, int32_t sum) { return sum + x * w; }

#endif
