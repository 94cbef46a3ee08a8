#include "stream_session_batch.h"

#include "stream_detector.h"
#include "stream_unpack.h"

typedef struct {
  unpackedStream_t unpacked;
  streamDetector_t detector;
} session_t;

int64_t streamSessionBytes(void) { return (int64_t)sizeof(session_t); }

int32_t streamSessionOpen(void *session, const motionConfig_t *motion, const flatStreamInt8_t *network,
                          const streamQuantisation_t *quantisation, const decoderConfig_t *decoder, int8_t *arena) {
  session_t *open = session;
  return unpackStream(network, &open->unpacked) < 0 &&
         streamDetectorInit(&open->detector, motion, &open->unpacked.network, quantisation, decoder, arena);
}

void streamSessionNext(void *session, const float *acc, const float *gyro, const float *pwm, int64_t samples,
                       streamEvent_t *events) {
  session_t *open = session;
  for (int64_t i = 0; i < samples; i++) {
    streamDetectorStep(&open->detector, acc + 3 * i, gyro + 3 * i, pwm + 4 * i, events + i);
  }
}
