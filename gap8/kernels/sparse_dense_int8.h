/**
 * @file sparse_dense_int8.h
 * Fully connected layer whose weights are blocks of four.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: each core of a team writes its own outputs and nothing else.
 * Memory: none.
 * Cost: 4 multiplications a block.
 */
#pragma once

#include "job_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

/**
 * @brief Fully connected layer whose weights are blocks of four, used where they lie.
 *
 * Needs a layer of kind LAYER_SPARSE_DENSE and inputs (inRows * inColumns * inChannels)
 * divisible by four; else as denseInt8, with the same result. Costs 4 multiplications
 * a block. Shared among cores by outputs, so that each has about as many blocks. Never
 * fails; reads no input outside the blocks that it is given.
 */
void sparseDenseInt8(const jobInt8_t *job);

#ifdef __cplusplus
}
#endif
