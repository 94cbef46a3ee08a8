/**
 * @file xpulp.h
 * The few instructions of GAP8's XPULP extension that the kernels use, under names of their own.
 *
 * On the chip (AIRTOUCH_PULP_BUILTINS) they are its compiler's builtins, one instruction each. With
 * `__riscv_xcvsimd` they are CORE-V's instructions, which are XPULP's under another
 * encoding: upstream compilers have those, so that the path can be compiled, run and
 * counted on a desktop. With AIRTOUCH_XPULP_EMULATION they are plain C, for every little-endian machine.
 * Elsewhere AIRTOUCH_XPULP is 0 and the kernels multiply byte by byte. All give the same bits.
 * A vector of four int8 is one int32 here, the first in its lowest byte.
 */
#pragma once

#include <stdint.h>

#include "extensions.h"

#if AIRTOUCH_PULP_BUILTINS
#define AIRTOUCH_XPULP 1

typedef signed char xpulpVector_t __attribute__((vector_size(4)));

/** Four bytes of memory: one load, a second one where they straddle two words. */
static inline int32_t xpulpLoad4(const int8_t *p) { return *(const int32_t __attribute__((may_alias)) *)p; }

static inline void xpulpStore4(int8_t *p, int32_t four) { *(int32_t __attribute__((may_alias)) *)p = four; }

/** sum + a[0] b[0] + a[1] b[1] + a[2] b[2] + a[3] b[3] */
static inline int32_t xpulpDot4(int32_t a, int32_t b, int32_t sum) {
  return __builtin_pulp_sdotsp4((xpulpVector_t)a, (xpulpVector_t)b, sum);
}

/** The larger of each pair of bytes. */
static inline int32_t xpulpMax4(int32_t a, int32_t b) {
  return (int32_t)__builtin_pulp_max4((xpulpVector_t)a, (xpulpVector_t)b);
}

/** Four bytes, the first one lowest. */
static inline int32_t xpulpPack4(int8_t a, int8_t b, int8_t c, int8_t d) {
  return (int32_t)__builtin_pulp_pack4(a, b, c, d);
}

/** (a + 1) >> 1; the sum must fit in int32. */
static inline int32_t xpulpHalve(int32_t a) { return __builtin_pulp_addRN(a, 0, 1, 1); }

/** (a + b + 2^(shift - 1)) >> shift for shift 1 to 31; the sum must fit in int32. */
static inline int32_t xpulpAddRoundShift(int32_t a, int32_t b, int32_t shift) {
  return __builtin_pulp_addRN_r(a, b, shift);
}

#elif defined(__riscv_xcvsimd) && AIRTOUCH_GNU
#define AIRTOUCH_XPULP 1

static inline int32_t xpulpLoad4(const int8_t *p) { return *(const int32_t __attribute__((may_alias)) *)p; }

static inline void xpulpStore4(int8_t *p, int32_t four) { *(int32_t __attribute__((may_alias)) *)p = four; }

static inline int32_t xpulpDot4(int32_t a, int32_t b, int32_t sum) {
  __asm__("cv.sdotsp.b %0, %1, %2" : "+r"(sum) : "r"(a), "r"(b));
  return sum;
}

static inline int32_t xpulpMax4(int32_t a, int32_t b) {
  int32_t larger;
  __asm__("cv.max.b %0, %1, %2" : "=r"(larger) : "r"(a), "r"(b));
  return larger;
}

static inline int32_t xpulpPack4(int8_t a, int8_t b, int8_t c, int8_t d) {
  int32_t packed = 0;
  __asm__("cv.packlo.b %0, %1, %2" : "+r"(packed) : "r"((int32_t)b), "r"((int32_t)a));
  __asm__("cv.packhi.b %0, %1, %2" : "+r"(packed) : "r"((int32_t)d), "r"((int32_t)c));
  return packed;
}

static inline int32_t xpulpHalve(int32_t a) {
  int32_t half;
  __asm__("cv.addrn %0, %1, zero, 1" : "=r"(half) : "r"(a));
  return half;
}

static inline int32_t xpulpAddRoundShift(int32_t a, int32_t b, int32_t shift) {
  __asm__("cv.addrnr %0, %1, %2" : "+r"(a) : "r"(b), "r"(shift));
  return a;
}

#elif defined(AIRTOUCH_XPULP_EMULATION)
#define AIRTOUCH_XPULP 1

#include <string.h>

static inline int32_t xpulpByte(int32_t word, int32_t i) { return (int8_t)((uint32_t)word >> (8 * i)); }

static inline int32_t xpulpPack4(int8_t a, int8_t b, int8_t c, int8_t d) {
  return (int32_t)((uint32_t)(uint8_t)a | (uint32_t)(uint8_t)b << 8 | (uint32_t)(uint8_t)c << 16 |
                   (uint32_t)(uint8_t)d << 24);
}

static inline int32_t xpulpLoad4(const int8_t *p) {
  int32_t four;
  memcpy(&four, p, sizeof(four));  // the lowest byte first, as on the chip
  return four;
}

static inline void xpulpStore4(int8_t *p, int32_t four) { memcpy(p, &four, sizeof(four)); }

static inline int32_t xpulpDot4(int32_t a, int32_t b, int32_t sum) {
  for (int32_t i = 0; i < 4; i++) {
    sum += xpulpByte(a, i) * xpulpByte(b, i);
  }
  return sum;
}

static inline int32_t xpulpMax4(int32_t a, int32_t b) {
  int8_t larger[4];
  for (int32_t i = 0; i < 4; i++) {
    larger[i] = (int8_t)(xpulpByte(a, i) > xpulpByte(b, i) ? xpulpByte(a, i) : xpulpByte(b, i));
  }
  return xpulpPack4(larger[0], larger[1], larger[2], larger[3]);
}

static inline int32_t xpulpHalve(int32_t a) { return (a + 1) >> 1; }

static inline int32_t xpulpAddRoundShift(int32_t a, int32_t b, int32_t shift) {
  return (a + b + (int32_t)(1u << (shift - 1))) >> shift;
}

#else
#define AIRTOUCH_XPULP 0
#endif
