#pragma once

#include "job_int8.h"

/**
 * @brief Maximum over kernelRows x kernelColumns blocks that do not overlap.
 *
 * Needs a layer of kind LAYER_MAX_POOL, outRows = inRows / kernelRows rounded down (the
 * remainder is dropped), outColumns likewise, outChannels = inChannels. Input and
 * output have the same scale and zero point and must not overlap. Shared among cores by
 * position. Never fails.
 */
void maxPoolInt8(const jobInt8_t *job);
