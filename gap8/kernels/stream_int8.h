/**
 * @file stream_int8.h
 * A network of causal convolutions over a stream, one sample at a time.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: streamState_t, 0.1 kB, and streamInt8ArenaBytes of the caller's, 3.4 kB for the shipped network.
 * Cost: the kept weights once on every stride-th sample, 32,145 instructions of a Cortex-M4; else a copy.
 */
#pragma once

#include "layer_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { STREAM_MAX_CONVS = 10 };

/**
 * A causal convolution of a stream, as the dense layer over its taps: inRows taps of
 * inChannels values, oldest first, to outChannels values.
 */
typedef struct {
  layerInt8_t layer;  ///< LAYER_DENSE or LAYER_SPARSE_DENSE
  int32_t dilation;   ///< rows between two taps
  int32_t zeroPoint;  ///< of its input: what the past before the first sample is made of
} streamConv_t;

/**
 * A network of causal convolutions in a row. The first one takes every `stride`-th
 * sample; the head, a dense layer, reads the newest row of each output from conv
 * `firstSkip` on, oldest conv first. All those outputs share one scale.
 */
typedef struct {
  const streamConv_t *convs;
  int32_t convCount;
  int32_t stride;
  int32_t firstSkip;
  const layerInt8_t *head;
} streamInt8_t;

/** What a network remembers of the past. The caller owns it and the arena behind it. */
typedef struct {
  int8_t *rings[STREAM_MAX_CONVS];   ///< input rows of each conv, in the arena
  int32_t newest[STREAM_MAX_CONVS];  ///< index of its newest row
  int8_t *patch;                     ///< the taps of one conv, gathered
  int8_t *skips;                     ///< what the head reads
  int32_t phase;                     ///< samples until the next one that is computed
} streamState_t;

/**
 * @brief Bytes of arena that streamInt8Reset needs: the rings ((taps - 1) * dilation + 1
 * rows for each conv), the widest patch and the head's input, each aligned to 4.
 */
int32_t streamInt8ArenaBytes(const streamInt8_t *network);

/**
 * @brief Whether the layers fit each other and the limits here; streamInt8Window + stride - 1 is at most 65,535.
 *
 * @return -1 where they do; else the index of the first conv that does not, convCount
 * for the head.
 */
int32_t streamInt8Check(const streamInt8_t *network);

/**
 * @brief Samples, the newest included, that the output at one step depends on, of a network that streamInt8Check
 * accepts.
 */
static inline uint16_t streamInt8Window(const streamInt8_t *network) {
  int32_t steps = 0;
  for (int32_t i = 1; i < network->convCount; i++) {
    steps += (network->convs[i].layer.inRows - 1) * network->convs[i].dilation;
  }
  return (uint16_t)(network->convs[0].layer.inRows + network->stride * steps);
}

/**
 * @brief Start anew: the past becomes zeros, the next sample is computed.
 *
 * Needs a network that streamInt8Check accepts and an arena of streamInt8ArenaBytes
 * bytes, aligned to 4, that nothing else uses while the state lives.
 */
void streamInt8Reset(const streamInt8_t *network, streamState_t *state, int8_t *arena);

/**
 * @brief Take one quantised sample (inChannels of the first conv values) and compute
 * what it changes, and nothing else: one row of each layer.
 *
 * Bit for bit the last row of the same convolutions over the whole past. Costs the
 * weights that are kept, once, on every stride-th sample, else a copy. Integer
 * arithmetic, no allocation, never fails.
 *
 * @return the head's output, inside the arena's patch, or NULL where the stride skips
 * this sample.
 */
const int8_t *streamInt8Step(const streamInt8_t *network, streamState_t *state, const int8_t *sample);

#ifdef __cplusplus
}
#endif
