#include "stream_detector.h"

#include <stddef.h>
#include <stdint.h>

#include "requantise.h"

bool streamDetectorInit(streamDetector_t *detector, const motionConfig_t *motion, const streamInt8_t *network,
                        const streamQuantisation_t *quantisation, const decoderConfig_t *decoder, int8_t *arena) {
  if (streamInt8Check(network) >= 0 || network->convs[0].layer.inChannels != MOTION_CHANNELS ||
      network->head->outChannels < EDGE_DECODER_LOGITS) {
    return false;
  }
  detector->network = network;
  detector->quantisation = *quantisation;
  motionChannelsInit(&detector->motion, motion);
  edgeDecoderInit(&detector->decoder, decoder);
  streamInt8Reset(network, &detector->state, arena);
  for (int i = 0; i < EDGE_DECODER_LOGITS; i++) {
    detector->logits[i] = 0.0f;
  }
  return true;
}

void streamQuantise(const streamQuantisation_t *quantisation, const float *channels, int32_t count, int8_t *q) {
  for (int32_t i = 0; i < count; i++) {
    q[i] = quantiseInput(channels[i], quantisation->inputScale, quantisation->inputZeroPoint);
  }
}

bool streamDetectorStep(streamDetector_t *detector, const float acc[3], const float gyro[3], const float pwm[4],
                        streamEvent_t *event) {
  float channels[MOTION_CHANNELS];
  int8_t quantised[MOTION_CHANNELS];
  motionChannelsStep(&detector->motion, acc, gyro, pwm, channels);
  streamQuantise(&detector->quantisation, channels, MOTION_CHANNELS, quantised);
  const int8_t *output = streamInt8Step(detector->network, &detector->state, quantised);
  const bool airborne = detector->motion.airborneSteps > 0;
  *event = (streamEvent_t){.ready = output != NULL, .airborne = airborne};
  if (output != NULL) {
    for (int i = 0; i < EDGE_DECODER_LOGITS; i++) {
      detector->logits[i] =
          detector->quantisation.outputScale * (float)(output[i] - detector->quantisation.outputZeroPoint);
    }
    event->edge = edgeDecoderStep(&detector->decoder, detector->logits, airborne);
  }
  for (int i = 0; i < EDGE_DECODER_LOGITS; i++) {
    event->logits[i] = detector->logits[i];
  }
  return event->edge != 0;
}
