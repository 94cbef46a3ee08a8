// The few functions of a C library that zig's runtime does not have. Plain, not fast:
// no kernel calls them in a step. Everything else (sinf, logf, memcpy, ...) is the runtime's.
#include <math.h>
#include <stddef.h>
#include <stdint.h>

typedef union {
  float value;
  uint32_t bits;
} floatBits_t;

__attribute__((weak)) float frexpf(float x, int *exponent) {
  floatBits_t number = {.value = x};
  const int field = (int)((number.bits >> 23) & 0xffu);
  *exponent = 0;
  if (x == 0.0f || field == 0xff) {
    return x;
  }
  if (field == 0) {  // denormal
    const float root = frexpf(x * 0x1p64f, exponent);
    *exponent -= 64;
    return root;
  }
  *exponent = field - 126;
  number.bits = (number.bits & 0x807fffffu) | (126u << 23);
  return number.value;
}

__attribute__((weak)) float ldexpf(float x, int exponent) {
  for (int i = 0; i < 2 && exponent > 127; i++) {
    x *= 0x1p127f;
    exponent -= 127;
  }
  for (int i = 0; i < 2 && exponent < -126; i++) {  // 24 bits short of the least power: no rounding on the way
    x *= 0x1p-102f;
    exponent += 102;
  }
  exponent = exponent > 127 ? 127 : (exponent < -126 ? -126 : exponent);
  const floatBits_t scale = {.bits = (uint32_t)(exponent + 127) << 23};
  return x * scale.value;
}

/** By double arithmetic, then rounded once: within half a unit in the last place, but for rare ties. */
__attribute__((weak)) float expm1f(float x) {
  const double t = (double)x;
  if (!(x > -0.5f && x < 0.5f)) {
    return (float)(exp(t) - 1.0);
  }
  double sum = 0.0;
  for (int i = 16; i >= 1; i--) {
    sum = (t / i) * (1.0 + sum);
  }
  return (float)sum;
}

__attribute__((weak)) size_t strlen(const char *text) {
  size_t length = 0;
  while (text[length] != '\0') {
    length++;
  }
  return length;
}
