/**
 * @file network_float.h
 * The same network in float: what the int8 one is checked against. Not for the drone.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: pure functions without state: any number at once.
 * Memory: networkFloatArenaSize floats of the caller's.
 * Cost: one multiplication a weight and position, in float: for tests, not for the drone.
 */
#pragma once

#include "layer_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  int32_t kind;  ///< LAYER_CONV, LAYER_MAX_POOL or LAYER_DENSE; shapes as in layerInt8_t
  int32_t inRows;
  int32_t inColumns;
  int32_t inChannels;
  int32_t outRows;
  int32_t outColumns;
  int32_t outChannels;
  int32_t kernelRows;
  int32_t kernelColumns;
  int32_t relu;          ///< whether negative outputs become 0
  const float *weights;  ///< laid out as in layerInt8_t
  const float *bias;     ///< [out]
} layerFloat_t;

typedef struct {
  const layerFloat_t *layers;
  int32_t layerCount;
} networkFloat_t;

/**
 * @brief Floats of working memory that networkFloatRun needs: the largest sum of one
 * layer's input and output, the network's own input not counted.
 */
int32_t networkFloatArenaSize(const networkFloat_t *network);

/**
 * @brief Run the network over one input, rows x columns x channels.
 *
 * Needs layers that fit each other and an arena of networkFloatArenaSize floats that
 * the caller owns. No allocation, never fails.
 *
 * @return the last layer's output, inside the arena.
 */
const float *networkFloatRun(const networkFloat_t *network, const float *input, float *arena);

#ifdef __cplusplus
}
#endif
