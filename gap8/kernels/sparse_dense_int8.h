#pragma once

#include "layer_int8.h"

/**
 * @brief Fully connected layer whose weights are blocks of four, used where they lie.
 *
 * Weights that pruning left come in blocks of four neighbouring inputs. For each
 * output channel, blockCounts says how many blocks it has; for each block, blockSkips
 * says how many blocks of four inputs to pass over before it (a gap of more than 255
 * is bridged by blocks of zero weights), and weights holds its four values. Five bytes
 * a block, nothing to unpack; with four channels to a word it is one load, one load
 * and one dot product.
 *
 * Needs `layer->kind` LAYER_SPARSE_DENSE and inputs (inRows * inColumns * inChannels)
 * divisible by four; else as denseInt8, with the same result. Costs 4 multiplications
 * a block. Never fails; reads no input outside the blocks that it is given.
 */
void sparseDenseInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output);
