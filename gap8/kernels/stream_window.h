/**
 * @file stream_window.h
 * How much of the past an answer of a streaming network depends on.
 *
 * Target: C11, any processor.
 * Threads: pure functions without state: any number at once.
 * Memory: none.
 * Cost: a loop over the convolutions.
 */
#pragma once

#include "stream_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Samples, the newest included, that the network's output at one step depends on. */
static inline uint16_t streamWindow(const streamInt8_t *network) {
  int32_t steps = 0;
  for (int32_t i = 1; i < network->convCount; i++) {
    steps += (network->convs[i].layer.inRows - 1) * network->convs[i].dilation;
  }
  return (uint16_t)(network->convs[0].layer.inRows + network->stride * steps);
}

#ifdef __cplusplus
}
#endif
