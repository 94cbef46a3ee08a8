/**
 * @file conv_int8.h
 * Two-dimensional convolution of int8 activations, with the max pool that may follow it.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: each core of a team writes its own outputs and nothing else.
 * Memory: a stack of 4 * CONV_MAX_FILTER bytes.
 * Cost: kernelRows * kernelColumns * inChannels multiplications an output, or those of the kept blocks.
 */
#pragma once

#include <stdbool.h>

#include "job_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CONV_MAX_FILTER = 64 };  // kernelRows * kernelColumns * inChannels at most, a multiple of four

/**
 * @brief Two-dimensional convolution of int8 activations, stride 1, no padding; with
 * `job->pool`, the max pool that follows as well.
 *
 * Needs a layer of kind LAYER_CONV or LAYER_SPARSE_CONV (a filter divisible by four),
 * a filter of at most CONV_MAX_FILTER values, an input of inRows x inColumns x
 * inChannels, and room for outRows x outColumns x outChannels of the layer, or of the pool
 * where there is one, where outRows is inRows - kernelRows + 1 and outColumns likewise.
 * A pool must be one that convCanPool accepts; the convolution's own output is then
 * never written. Input and output must not overlap.
 *
 * Four neighbouring positions are copied to a stack of 4 * CONV_MAX_FILTER bytes, then multiplied with two
 * channels at a time, so that six loads serve eight products. Costs kernelRows *
 * kernelColumns * inChannels multiplications for each output, or those of the blocks that
 * are kept. Shared among cores by position and channel. Never fails.
 */
void convInt8(const jobInt8_t *job);

/**
 * @brief Whether convInt8 can do a pool on the way: two positions to one.
 */
bool convCanPool(const layerInt8_t *pool);

#ifdef __cplusplus
}
#endif
