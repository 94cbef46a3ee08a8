#pragma once

#include "job_int8.h"

/**
 * @brief Fully connected layer whose weights are blocks of four, used where they lie.
 *
 * Needs a layer of kind LAYER_SPARSE_DENSE and inputs (inRows * inColumns * inChannels)
 * divisible by four; else as denseInt8, with the same result. Costs 4 multiplications
 * a block. Shared among cores by outputs, so that each has about as many blocks. Never
 * fails; reads no input outside the blocks that it is given.
 */
void sparseDenseInt8(const jobInt8_t *job);
