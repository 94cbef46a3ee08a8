/**
 * @file max_pool_int8.h
 * Maximum over blocks of int8 activations.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: each core of a team writes its own outputs and nothing else.
 * Memory: none.
 * Cost: kernelRows * kernelColumns comparisons an output.
 */
#pragma once

#include "job_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

/**
 * @brief Maximum over kernelRows x kernelColumns blocks that do not overlap.
 *
 * Needs a layer of kind LAYER_MAX_POOL, outRows = inRows / kernelRows rounded down (the
 * remainder is dropped), outColumns likewise, outChannels = inChannels. Input and
 * output have the same scale and zero point and must not overlap. Shared among cores by
 * position. Never fails.
 */
void maxPoolInt8(const jobInt8_t *job);

#ifdef __cplusplus
}
#endif
