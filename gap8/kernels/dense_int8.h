#pragma once

#include "job_int8.h"

/**
 * @brief Fully connected layer of int8 activations.
 *
 * Needs a layer of kind LAYER_DENSE, an input of inRows * inColumns * inChannels values
 * (taken as one vector in HWC order) and room for outChannels values; outRows and
 * outColumns are 1. The two must not overlap. Costs inputs * outChannels
 * multiplications. Shared among cores by pairs of outputs. Never fails.
 */
void denseInt8(const jobInt8_t *job);
