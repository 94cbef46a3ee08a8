#pragma once

#include "layer_int8.h"

// A network: layers in order, each reading what the one before wrote.
typedef struct {
  const layerInt8_t *layers;
  int32_t layerCount;
  float inputScale;  // q = floor(x / inputScale + 0.5) + inputZeroPoint
  int32_t inputZeroPoint;
  float outputScale;  // logit = outputScale * (q - outputZeroPoint)
  int32_t outputZeroPoint;
} networkInt8_t;

/**
 * @brief Bytes of working memory that networkInt8Run needs.
 *
 * The largest sum of one layer's input and output; the network's own input is read
 * where it lies and does not count. 7,056 for the paper's network.
 */
int32_t networkInt8ArenaBytes(const networkInt8_t *network);

/**
 * @brief Whether the layers fit each other: each one's input is the output of the one
 * before it, and each one's output follows from its input and kernel.
 *
 * @return -1 where they do, else the index of the first layer that does not.
 */
int32_t networkInt8Check(const networkInt8_t *network);

/**
 * @brief Quantise an input: q = floor(x / inputScale + 0.5) + inputZeroPoint, clamped
 * to int8; NaN counts as 0. One division a value.
 */
void networkInt8Quantise(const networkInt8_t *network, const float *x, int32_t count, int8_t *q);

/**
 * @brief Run the network over one quantised input.
 *
 * Needs a network that networkInt8Check accepts, with at least one layer, and an arena
 * of networkInt8ArenaBytes bytes, aligned to 4, that the caller owns; nothing is kept
 * in it between calls. Integer arithmetic only, no allocation, the same work for every
 * input: 266 k multiplications for the paper's network, 238 k with a dense layer of
 * 80 % zeros.
 *
 * @return the last layer's output, inside the arena.
 */
const int8_t *networkInt8Run(const networkInt8_t *network, const int8_t *input, int8_t *arena);
