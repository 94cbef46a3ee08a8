/**
 * @file edge_decoder.h
 * From the streaming network's three logits (over a platform, entry now, exit now)
 * to edges: an event fires where its own logit and the state agree, or late where
 * the state alone has changed for good. The step at which the network is sure is
 * later than the crossing, by a delay that varies. The decoder therefore takes the
 * peak of the event's logit for the crossing and reports the edge a fixed time after
 * that peak, so that the delay is one constant.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: edgeDecoder_t alone, 0.6 kB.
 * Cost: 130 instructions of a Cortex-M4 a step, 730 where an edge is seen (`python -m tools.instruction_counts.count`).
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "kernel_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Steps of the event logits that are kept: the largest lookBack is one less. */
#define EDGE_DECODER_RING 64

/** The decoder's memory. */
typedef struct {
  decoderConfig_t config;
  float recent[2][EDGE_DECODER_RING];  ///< entry and exit logits, newest at `newest`
  uint32_t newest;
  float peak;              ///< logit at the crossing of the edge that waits
  uint32_t due;            ///< steps until it is reported
  uint8_t waiting;         ///< its kind: 0 none, 1 entry, 2 exit
  float smoothedOver;      ///< smoothed over logit
  uint32_t airborneSteps;  ///< steps in the air without a break
  uint32_t since;          ///< steps since the last edge
  bool over;               ///< over a platform
} edgeDecoder_t;

/** Sets the decoder up; the settings are copied. */
void edgeDecoderInit(edgeDecoder_t *decoder, const decoderConfig_t *config);

/**
 * Takes the logits of one step.
 * @param logits    over, entry, exit; NaN counts as "no"
 * @param airborne  whether the drone flies; on the ground it is over nothing
 * @return 0 nothing, 1 entry, 2 exit
 * Never fails.
 */
uint8_t edgeDecoderStep(edgeDecoder_t *decoder, const float logits[EDGE_DECODER_LOGITS], bool airborne);

#ifdef __cplusplus
}
#endif
