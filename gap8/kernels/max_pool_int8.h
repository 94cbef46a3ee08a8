#pragma once

#include "layer_int8.h"

/**
 * @brief Maximum over kernelRows x kernelColumns blocks that do not overlap.
 *
 * Needs `layer->kind` LAYER_MAX_POOL, outRows = inRows / kernelRows rounded down (the
 * remainder is dropped), outColumns likewise, outChannels = inChannels. Input and
 * output have the same scale and zero point and must not overlap. Never fails.
 */
void maxPoolInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output);
