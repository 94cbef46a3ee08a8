/**
 * @file dense_int8.h
 * Fully connected layer of int8 activations.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: each core of a team writes its own outputs and nothing else.
 * Memory: none.
 * Cost: inputs * outChannels multiplications.
 */
#pragma once

#include "job_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

/**
 * @brief Fully connected layer of int8 activations.
 *
 * Needs a layer of kind LAYER_DENSE, an input of inRows * inColumns * inChannels values
 * (taken as one vector in HWC order) and room for outChannels values; outRows and
 * outColumns are 1. The two must not overlap. Costs inputs * outChannels
 * multiplications. Shared among cores by pairs of outputs. Never fails.
 */
void denseInt8(const jobInt8_t *job);

#ifdef __cplusplus
}
#endif
