/**
 * @file stream_detector.h
 * The streaming detector in one struct: motion channels, int8 network, decoder.
 * One step a sample at 100 Hz; the network runs on every stride-th one.
 * The network's layers are those of gap8/kernels, which are plain C wherever there is no GAP8: so both processors
 * compute the same bits, and the STM32 can go on where the GAP8 stopped.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: streamDetector_t and the arena, 4.3 kB for the shipped network; 280 bytes of stack.
 * Cost: 33,060 instructions of a Cortex-M4 on every stride-th sample, else 1,000.
 */
#pragma once

#include <stdbool.h>

#include "edge_decoder.h"
#include "kernel_types.h"
#include "motion_channels.h"
#include "stream_int8.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The detector. The network and the arena belong to the caller and must outlive it. */
typedef struct {
  const streamInt8_t *network;
  streamQuantisation_t quantisation;
  motionChannels_t motion;
  edgeDecoder_t decoder;
  streamState_t state;
  float logits[EDGE_DECODER_LOGITS];
} streamDetector_t;

/**
 * Sets a detector up; the settings are copied.
 * @param arena  streamInt8ArenaBytes(network) bytes, aligned to 4, used by nothing else
 * @return false for a network that does not take MOTION_CHANNELS channels or give EDGE_DECODER_LOGITS logits at least
 */
bool streamDetectorInit(streamDetector_t *detector, const motionConfig_t *motion, const streamInt8_t *network,
                        const streamQuantisation_t *quantisation, const decoderConfig_t *decoder, int8_t *arena);

/**
 * Takes one sample and says what it means.
 * @param event  every field is written
 * @return whether an edge is reported at this sample
 * Costs about 33,000 instructions of a Cortex-M4 on every stride-th sample, else 1,000.
 * Never fails: values that are not finite hold the last finite one.
 */
bool streamDetectorStep(streamDetector_t *detector, const float acc[3], const float gyro[3], const float pwm[4],
                        streamEvent_t *event);

/** Quantise channels as the network takes them. */
void streamQuantise(const streamQuantisation_t *quantisation, const float *channels, int32_t count, int8_t *q);

#ifdef __cplusplus
}
#endif
