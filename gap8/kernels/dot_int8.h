// Dot product of two int8 vectors in int32, the inner loop of every layer here.
#pragma once

#include <stdint.h>

static inline int32_t dotInt8(const int8_t *a, const int8_t *b, int32_t count) {
  int32_t sum = 0;
  for (int32_t i = 0; i < count; i++) {
    sum += (int32_t)a[i] * (int32_t)b[i];
  }
  return sum;
}
