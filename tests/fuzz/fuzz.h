/**
 * @file fuzz.h
 * What every fuzz target shares: values drawn from the bytes of an input, and promises that end the run where they
 * are broken. A target is one file with LLVMFuzzerTestOneInput(); host/docs/fuzzing.md says how to build and run it.
 */
#pragma once

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/** Ends the run with @p promise, and the place in the source, unless @p kept. */
#define CHECK(kept, promise) \
  ((kept) ? (void)0 : (fprintf(stderr, "%s:%d: broken promise: %s\n", __FILE__, __LINE__, promise), abort()))

/** The bytes of an input that are not used yet. Reading past their end gives zeros. */
typedef struct {
  const uint8_t *at;
  size_t left;
} bytes_t;

static inline uint8_t takeByte(bytes_t *bytes) {
  if (bytes->left == 0) {
    return 0;
  }
  bytes->left--;
  return *bytes->at++;
}

/** Fills @p to with the next @p size bytes. */
static inline void takeInto(bytes_t *bytes, void *to, size_t size) {
  const size_t count = size < bytes->left ? size : bytes->left;
  memset(to, 0, size);
  if (count > 0) {
    memcpy(to, bytes->at, count);
    bytes->at += count;
    bytes->left -= count;
  }
}

static inline uint32_t takeWord(bytes_t *bytes) {
  uint32_t word;
  takeInto(bytes, &word, sizeof word);
  return word;
}

/** A number from 0 to @p limit - 1, of as few bytes as it needs. */
static inline uint32_t takeBelow(bytes_t *bytes, uint32_t limit) {
  if (limit <= 256) {
    return takeByte(bytes) % limit;
  }
  uint16_t value;
  takeInto(bytes, &value, sizeof value);
  return limit <= 65536 ? value % limit : takeWord(bytes) % limit;
}

/** A number from @p low to @p high. */
static inline int32_t takeBetween(bytes_t *bytes, int32_t low, int32_t high) {
  return low + (int32_t)takeBelow(bytes, (uint32_t)(high - low) + 1u);
}

/** A float of any bits: NaN, infinity, denormal. */
static inline float takeAnyFloat(bytes_t *bytes) {
  float value;
  takeInto(bytes, &value, sizeof value);
  return value;
}

/** Mostly one byte: a value of a few times @p usual; now and then one of the values that break code, or any bits. */
static inline float takeFloat(bytes_t *bytes, float usual) {
  static const float rare[] = {NAN,      INFINITY, -INFINITY, 0.0f,  -0.0f,    1e-45f,   FLT_MIN, FLT_MAX,
                               -FLT_MAX, 1e15f,    -1e15f,    1e16f, 65535.0f, 65536.0f, 1e-20f,  -1.0f};
  const uint8_t code = takeByte(bytes);
  if (code < 224) {
    return usual * ((float)code - 112.0f) * (1.0f / 32.0f);
  }
  return code < 240 ? rare[code - 224] : takeAnyFloat(bytes);
}

/** The same, but never NaN and never beyond @p limit. */
static inline float takeFinite(bytes_t *bytes, float usual, float limit) {
  const float value = takeFloat(bytes, usual);
  return value == value ? fminf(fmaxf(value, -limit), limit) : 0.0f;
}

/**
 * Whether this input is one of those, one in @p n, that may cost more. A hash of all bytes says so: a bit of the input
 * would be set in nearly the whole corpus, since inputs that run for longer reach more.
 */
static inline bool oneIn(uint32_t n, const uint8_t *data, size_t size) {
  uint32_t hash = 2166136261u;
  for (size_t i = 0; i < size; i++) {
    hash = (hash ^ data[i]) * 16777619u;
  }
  return (hash >> 16) % n == 0;
}

/** Uniform noise, -1 to 1, from a seed: long runs of samples from few bytes. */
static inline float noise(uint32_t *seed) {
  *seed = *seed * 1664525u + 1013904223u;
  return (float)(*seed >> 8) * (1.0f / 8388608.0f) - 1.0f;
}

/** Memory of exactly @p size bytes full of rubbish, so that a byte too far or one never written is seen. */
static inline void *rubbish(size_t size, uint8_t filling) {
  void *memory = malloc(size > 0 ? size : 1);
  CHECK(memory != NULL, "memory for the harness");
  memset(memory, filling, size);
  return memory;
}

/** A copy of exactly @p size bytes. */
static inline void *exactCopy(const void *from, size_t size) {
  void *copy = malloc(size);  // of no byte at all where there is none to read
  CHECK(copy != NULL || size == 0, "memory for the harness");
  if (size > 0) {
    memcpy(copy, from, size);
  }
  return copy;
}
