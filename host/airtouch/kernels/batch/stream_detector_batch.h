// Whole flights through motion_channels.h, edge_decoder.h and stream_detector.h. Row-major; rows are samples.
#include <stdint.h>

#include "kernel_types.h"
#include "stream_batch.h"

/** channels (samples, 12) of acc (samples, 3), gyro (samples, 3), PWM (samples, 4); airborne (samples). */
void motionChannelsBatch(const float *acc, const float *gyro, const float *pwm, int64_t samples,
                         const motionConfig_t *config, float *channels, uint8_t *airborne);
/** edges (steps) of logits (steps, 3) and airborne (steps). */
void edgeDecoderBatch(const float *logits, const uint8_t *airborne, int64_t steps, const decoderConfig_t *config,
                      uint8_t *edges);
/** One event a sample. arena: streamInt8BatchArena(network) bytes. Returns 0 for a network that does not fit. */
int32_t streamDetectorFlight(const float *acc, const float *gyro, const float *pwm, int64_t samples,
                             const motionConfig_t *motion, const flatStreamInt8_t *network,
                             const streamQuantisation_t *quantisation, const decoderConfig_t *decoder, int8_t *arena,
                             streamEvent_t *events);
