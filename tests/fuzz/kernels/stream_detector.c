// stream_detector.h with the shipped network: any samples and decoder settings. Logits are numbers that the network's
// scale has, the network runs on every stride-th sample, edges need flight, and two detectors that begin in other
// rubbish say the same.
#include "airtouch_stream.h"
#include "stream_detector.h"

#include "fuzz.h"

// Samples of an input, at most: each costs two networks, and most inputs need not fill the window.
#define FEW_SAMPLES 24
#define MANY_SAMPLES 300

typedef struct {
  streamDetector_t *detector;
  int8_t *arena;
} one_t;

static one_t begin(const decoderConfig_t *decoder, uint8_t filling) {
  one_t one = {rubbish(sizeof(streamDetector_t), filling), rubbish(AIRTOUCH_STREAM_ARENA_BYTES, filling)};
  CHECK(streamInt8ArenaBytes(&airtouchStream) == AIRTOUCH_STREAM_ARENA_BYTES,
        "the arena is as large as the header says");
  CHECK(streamDetectorInit(one.detector, &airtouchStreamMotion, &airtouchStream, &airtouchStreamQuantisation, decoder,
                           one.arena),
        "the shipped network is accepted");
  return one;
}

static void end(one_t one) {
  free(one.detector);
  free(one.arena);
}

static void checkEvent(const streamEvent_t *event, bool reported, int count) {
  const streamQuantisation_t *scale = &airtouchStreamQuantisation;
  CHECK(reported == (event->edge != 0) && event->edge <= 2 && event->airborne <= 1, "an edge is none, entry or exit");
  CHECK(event->ready == (count % airtouchStream.stride == 0), "the network runs on every stride-th sample");
  CHECK(!event->edge || (event->airborne && event->ready), "an edge comes in the air, from new logits");
  for (int i = 0; i < EDGE_DECODER_LOGITS; i++) {
    const double steps = event->logits[i] / (double)scale->outputScale + scale->outputZeroPoint;
    CHECK(fabs(steps - rint(steps)) < 1e-3 && steps > -128.5 && steps < 127.5, "a logit is an int8 of the network");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t kind = takeByte(&bytes);
  decoderConfig_t decoder = airtouchStreamDecoder;
  if (kind & 1) {
    takeInto(&bytes, &decoder, sizeof decoder);
  }
  const one_t one = begin(&decoder, 0xff), other = begin(&decoder, 0);
  uint32_t seed = kind;
  const int most = oneIn(8, data, size) ? MANY_SAMPLES : FEW_SAMPLES;
  for (int count = 0; count == 0 || (count < most && bytes.left > 0);) {
    const uint8_t what = takeByte(&bytes);
    for (int run = what & 1 ? 0 : what / 8; run >= 0 && count < most; run--, count++) {
      float sample[10];
      streamEvent_t event, same;
      for (int i = 0; i < 10; i++) {
        sample[i] = what & 1 ? takeFloat(&bytes, i < 6 ? 10.0f : 3e4f)
                             : (i < 6 ? (float)(what & 6) * noise(&seed) : 4e4f + 4e3f * noise(&seed));
      }
      const bool reported = streamDetectorStep(one.detector, sample, sample + 3, sample + 6, &event);
      checkEvent(&event, reported, count);
      streamDetectorStep(other.detector, sample, sample + 3, sample + 6, &same);
      CHECK(memcmp(event.logits, same.logits, sizeof event.logits) == 0 && event.edge == same.edge,
            "what a detector says follows from its settings and samples alone");
    }
  }
  end(one);
  end(other);
  return 0;
}
