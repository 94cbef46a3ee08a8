/**
 * @file network_int8.h
 * The int8 network over a whole window, on one core or several.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: the arena is one caller's, or one team's of cores; networks are constants.
 * Memory: networkInt8ArenaBytes of the caller's, 4,560 for the paper's network.
 * Cost: 262 k multiplications for the paper's network, 233 k pruned.
 */
#pragma once

#include "job_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A network: layers in order, each reading what the one before wrote. */
typedef struct {
  const layerInt8_t *layers;
  int32_t layerCount;
  float inputScale;  ///< q = floor(x / inputScale + 0.5) + inputZeroPoint
  int32_t inputZeroPoint;
  float outputScale;  ///< logit = outputScale * (q - outputZeroPoint)
  int32_t outputZeroPoint;
} networkInt8_t;

/**
 * @brief Bytes of working memory that networkInt8Run needs.
 *
 * The largest sum of one step's input and output, a convolution and the pool after it
 * being one step; the network's own input is read where it lies and does not count. 4,560
 * for the paper's network.
 */
int32_t networkInt8ArenaBytes(const networkInt8_t *network);

/**
 * @brief Whether the layers fit each other: each one's input is the output of the one
 * before it, each one's output follows from its input and kernel, and the kernels can run it.
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
 * @brief Run the network over one quantised input, on one core.
 *
 * Needs a network that networkInt8Check accepts, with at least one layer, an input and an
 * arena of networkInt8ArenaBytes bytes, both aligned to 4 and owned by the caller;
 * nothing is kept in the arena between calls. Integer arithmetic only, no allocation, the
 * same work for every input: 262 k multiplications for the paper's network, 233 k with a
 * dense layer of 80 % zeros (a row that its pool drops is not computed).
 *
 * @return the last layer's output, inside the arena.
 */
const int8_t *networkInt8Run(const networkInt8_t *network, const int8_t *input, int8_t *arena);

/**
 * @brief The same on several cores: each calls this with its own `team->core`, all else alike.
 *
 * The result is the same to the last bit for any number of cores. The barrier is called
 * once after each step (4 for the paper's network), so the output may be read
 * by any core that has returned.
 */
const int8_t *networkInt8RunTeam(const networkInt8_t *network, const int8_t *input, int8_t *arena,
                                 const teamInt8_t *team);

/**
 * @brief What one core does of one layer, by the layer's kind. No barrier.
 */
void layerInt8Run(const jobInt8_t *job);

#ifdef __cplusplus
}
#endif
