#include "stream_detector_batch.h"

#include "edge_decoder.h"
#include "motion_channels.h"
#include "stream_detector.h"
#include "stream_unpack.h"

void motionChannelsBatch(const float *acc, const float *gyro, const float *pwm, int64_t samples,
                         const motionConfig_t *config, float *channels, uint8_t *airborne) {
  motionChannels_t motion;
  motionChannelsInit(&motion, config);
  for (int64_t i = 0; i < samples; i++) {
    motionChannelsStep(&motion, acc + 3 * i, gyro + 3 * i, pwm + 4 * i, channels + MOTION_CHANNELS * i);
    airborne[i] = motion.airborneSteps > 0;
  }
}

void edgeDecoderBatch(const float *logits, const uint8_t *airborne, int64_t steps, const decoderConfig_t *config,
                      uint8_t *edges) {
  edgeDecoder_t decoder;
  edgeDecoderInit(&decoder, config);
  for (int64_t i = 0; i < steps; i++) {
    edges[i] = edgeDecoderStep(&decoder, logits + EDGE_DECODER_LOGITS * i, airborne[i] != 0);
  }
}

int32_t streamDetectorFlight(const float *acc, const float *gyro, const float *pwm, int64_t samples,
                             const motionConfig_t *motion, const flatStreamInt8_t *network,
                             const streamQuantisation_t *quantisation, const decoderConfig_t *decoder, int8_t *arena,
                             streamEvent_t *events) {
  unpackedStream_t to;
  streamDetector_t detector;
  if (unpackStream(network, &to) >= 0 ||
      !streamDetectorInit(&detector, motion, &to.network, quantisation, decoder, arena)) {
    return 0;
  }
  for (int64_t i = 0; i < samples; i++) {
    streamDetectorStep(&detector, acc + 3 * i, gyro + 3 * i, pwm + 4 * i, events + i);
  }
  return 1;
}
