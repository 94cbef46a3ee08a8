#pragma once

#include "layer_int8.h"

/**
 * @brief Fully connected layer of int8 activations.
 *
 * Needs `layer->kind` LAYER_DENSE, an input of inRows * inColumns * inChannels values
 * (taken as one vector in HWC order) and room for outChannels values; outRows and
 * outColumns are 1. The two must not overlap. Costs inputs * outChannels
 * multiplications. Never fails.
 */
void denseInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output);
