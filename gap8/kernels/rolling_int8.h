/**
 * @file rolling_int8.h
 * The network of windows, a sample at a time: each step computes only what the new sample changes.
 *
 * Target: C11, any processor, no FPU; GAP8's XPULP and a Cortex-M4's SIMD where the compiler has them
 *   (extensions.h), same bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: rollingInt8_t, 1.5 kB, and rollingInt8ArenaBytes of the caller's.
 * Cost: 40 k multiplications a sample for the paper's network at stride 1, 11 k at stride 4.
 */
#pragma once

#include <stdbool.h>

#include "network_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { ROLLING_MAX_STEPS = 8, ROLLING_MAX_STRIDE = 16 };

/**
 * One step of a rolling network: a layer, or a convolution with its pool, that makes one
 * row out of the newest `taps` rows of its input which lie `dilation` rows apart.
 */
typedef struct {
  layerInt8_t layer;  ///< as in the windowed network, for one row of output
  layerInt8_t pool;   ///< kind LAYER_MAX_POOL where one is done on the way
  int8_t *ring;       ///< rows of input: for each of `dilation` phases 2 * taps rows, each row kept twice
  int32_t taps;
  int32_t dilation;
  int32_t rowBytes;  ///< of the input
  int32_t period;    ///< input rows to one row of output
  int32_t phase;     ///< dilation phase of the next input row
  int32_t place;     ///< its row within the phase, below taps
  int32_t wait;      ///< input rows until the next row of output
} rollingStep_t;

/** A windowed network that rolls over a stream. The caller owns it and the arena behind it. */
typedef struct {
  rollingStep_t steps[ROLLING_MAX_STEPS];
  int8_t *output;  ///< of the last step
  int32_t stepCount;
  int32_t stride;            ///< samples to one output
  int32_t ahead;             ///< samples by which an output is earlier than its window's end
  int32_t receptiveSamples;  ///< samples that an output depends on
  int32_t seen;              ///< samples since the reset, at most receptiveSamples
} rollingInt8_t;

/**
 * @brief Work out steps, stride, ahead and receptiveSamples, without an arena: for rollingInt8Init, and to ask.
 *
 * A network can roll where networkInt8Check accepts it, dense layers follow its convolutions
 * and pools, and the stride is what its first pools make together: 1, 2 or 4 for the paper's.
 *
 * @return false where this network cannot roll at this stride.
 */
bool rollingInt8Plan(rollingInt8_t *self, const networkInt8_t *network, int32_t stride);

/**
 * @brief Bytes of arena of a network that rollingInt8Plan has planned.
 */
int32_t rollingInt8PlanBytes(const rollingInt8_t *planned);

/**
 * @brief Bytes of arena that rollingInt8Init needs; 0 where this network cannot roll at
 * this stride. 19,256, 9,564 and 4,860 for the paper's network at stride 1, 2 and 4.
 * Plans on the stack: 1.5 kB.
 */
int32_t rollingInt8ArenaBytes(const networkInt8_t *network, int32_t stride);

/**
 * @brief Set up, with a past that is empty.
 *
 * Needs an arena of rollingInt8ArenaBytes bytes, aligned to 4, and the network's constants, for as long as
 * `self` lives. The same constants serve windows and the stream.
 *
 * @return false where the network cannot roll at this stride; `self` is then of no use.
 */
bool rollingInt8Init(rollingInt8_t *self, const networkInt8_t *network, int32_t stride, int8_t *arena);

/**
 * @brief Forget the past: the next output comes after `receptiveSamples` samples.
 */
void rollingInt8Reset(rollingInt8_t *self);

/**
 * @brief Take one quantised sample (inColumns * inChannels of the first layer) and compute
 * what it changes, and nothing else: one row of each layer.
 *
 * The output is bit for bit what networkInt8Run gives for the window that ends `ahead`
 * samples later: the paper's second pool drops its newest row, so two samples before
 * a window is full its answer is known. Outputs come on every stride-th sample; then a
 * row of a layer is computed only where a later one reads it. Costs, for the paper's
 * network, 40 k multiplications a sample at stride 1 and 11 k at stride 4, of which pruned
 * blocks of four are left out. Integer arithmetic, no allocation, one core, never fails.
 *
 * @return the last layer's output, valid until the next call, or NULL where there is none.
 */
const int8_t *rollingInt8Step(rollingInt8_t *self, const int8_t *sample);

#ifdef __cplusplus
}
#endif
