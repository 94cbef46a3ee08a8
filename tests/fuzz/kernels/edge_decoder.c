// edge_decoder.h: any settings and logits. Kinds alternate, none comes on the ground, before the drone has flown for
// long enough, or more often than the dwell allows; and a landing forgets everything, so that a decoder that has just
// begun says the same from there on.
#include "airtouch_stream.h"
#include "edge_decoder.h"

#include "fuzz.h"

#define STEPS 2000

typedef struct {
  edgeDecoder_t *decoder;
  uint8_t last;       // kind reported last in this flight
  uint32_t airborne;  // steps in the air
  uint32_t reports;   // in this flight
} flight_t;

static uint8_t step(flight_t *flight, const float logits[EDGE_DECODER_LOGITS], bool airborne) {
  const decoderConfig_t *config = &flight->decoder->config;
  float *exact = exactCopy(logits, EDGE_DECODER_LOGITS * sizeof *logits);
  const uint8_t edge = edgeDecoderStep(flight->decoder, exact, airborne);
  free(exact);
  if (!airborne) {
    CHECK(edge == 0, "no edge on the ground");
    flight->airborne = flight->reports = 0;
    flight->last = 0;
    return edge;
  }
  flight->airborne++;
  CHECK(edge <= 2, "an edge is none, entry or exit");
  if (edge != 0) {
    CHECK(edge == (flight->last == 1 ? 2 : 1), "entries and exits alternate, an entry first");
    CHECK(flight->airborne >= config->armSteps, "the drone has flown for as long as the setting says");
    flight->reports++;
    const uint32_t dwell = config->dwellSteps > 1 ? config->dwellSteps : 1;
    CHECK((uint64_t)(flight->reports - 1) * dwell <= flight->airborne, "not more edges than the dwell allows");
    flight->last = edge;
  }
  return edge;
}

static decoderConfig_t takeConfig(bytes_t *bytes, uint8_t kind) {
  decoderConfig_t config = airtouchStreamDecoder;
  if (kind & 1) {
    config.overShare = takeFloat(bytes, 0.5f);
    config.entryScore = takeFloat(bytes, 3.0f);
    config.exitScore = takeFloat(bytes, 3.0f);
    config.lateEntry = takeFloat(bytes, 3.0f);
    config.lateExit = takeFloat(bytes, 3.0f);
    config.smoothGain = takeFloat(bytes, 0.3f);
  }
  if (kind & 2) {
    config.dwellSteps = takeByte(bytes) % 64;
    config.armSteps = takeByte(bytes) % 64;
    config.lookBack = kind & 4 ? takeWord(bytes) : takeByte(bytes) % 64;
    config.holdSteps = kind & 8 ? takeWord(bytes) : takeByte(bytes) % 64;
  }
  return config;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t kind = takeByte(&bytes);
  const decoderConfig_t config = takeConfig(&bytes, kind);
  flight_t flight = {.decoder = rubbish(sizeof(edgeDecoder_t), 0xff)},
           fresh = {.decoder = rubbish(sizeof(edgeDecoder_t), 0)};
  uint32_t seed = kind;
  bool landed = false;
  edgeDecoderInit(flight.decoder, &config);
  for (int count = 0; count == 0 || (count < STEPS && bytes.left > 0);) {
    const uint8_t what = takeByte(&bytes);
    const bool airborne = what % 32 != 31;
    if (!airborne && !landed) {
      landed = true;
      edgeDecoderInit(fresh.decoder, &config);
    }
    float logits[EDGE_DECODER_LOGITS];
    for (int i = 0; i < EDGE_DECODER_LOGITS; i++) {
      logits[i] = what & 1 ? takeFloat(&bytes, 3.0f) : 3.0f * noise(&seed);
    }
    for (int run = what / 32 * (what & 2 ? 8 : 1); run >= 0; run--, count++) {
      const uint8_t edge = step(&flight, logits, airborne);
      CHECK(!landed || step(&fresh, logits, airborne) == edge, "a landing forgets everything");
    }
  }
  free(flight.decoder);
  free(fresh.decoder);
  return 0;
}
