#pragma once

#include "layer_int8.h"

/**
 * @brief Two-dimensional convolution of int8 activations, stride 1, no padding.
 *
 * Needs `layer->kind` LAYER_CONV, an input of inRows x inColumns x inChannels and
 * room for outRows x outColumns x outChannels, where outRows is
 * inRows - kernelRows + 1 and outColumns likewise. The two must not overlap.
 * Costs outRows * outColumns * outChannels * kernelRows * kernelColumns * inChannels
 * multiplications; no memory of its own. Never fails.
 */
void convInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output);
