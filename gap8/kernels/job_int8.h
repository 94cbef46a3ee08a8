/**
 * @file job_int8.h
 * What one core is asked to do of a layer, and how a layer is shared among cores.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: a job belongs to one core.
 * Memory: plain values; the arrays are the caller's.
 * Cost: none.
 */
#pragma once

#include <stdint.h>

#include "layer_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

/**
 * Every core of a team calls a kernel with the same layer, input and output and its own
 * `core`. It writes its own outputs and no other byte; which those are follows from core
 * and cores alone. Nobody may read the output before all have returned.
 */
typedef struct {
  const layerInt8_t *layer;
  const layerInt8_t *pool;  ///< convInt8: the max pool that follows, done on the way; else NULL
  const int8_t *input;      ///< aligned to 4
  int8_t *output;
  int32_t core;   ///< 0 to cores - 1
  int32_t cores;  ///< 1 or more
} jobInt8_t;

/**
 * The cores that run a network together. barrier(context) returns once every core has
 * called it and makes what they wrote before visible to all; it may be NULL for one core.
 */
typedef struct {
  int32_t core;
  int32_t cores;
  void (*barrier)(void *context);
  void *context;
} teamInt8_t;

/** The first of `items` that belongs to a core; its last is before the next core's first. */
static inline int32_t shareBegin(int32_t items, int32_t core, int32_t cores) { return items * core / cores; }

#ifdef __cplusplus
}
#endif
