#include "edge_decoder.h"

#include "sample_guard.h"

#define LOGIT_LIMIT 8.0f    // logits are clamped to this magnitude
#define SLOW_AT_START -3.0f // the smoothed logit before anything is known: off a platform
#define LONG_AGO 0x3fffffffu

static void forget(edgeDecoder_t *decoder) {
  decoder->slow = SLOW_AT_START;
  decoder->since = LONG_AGO;
  decoder->over = false;
}

void edgeDecoderInit(edgeDecoder_t *decoder, const decoderConfig_t *config) {
  decoder->config = *config;
  decoder->airborne = 0;
  forget(decoder);
}

static float limited(float logit) {
  return logit == logit ? clampFloat(logit, -LOGIT_LIMIT, LOGIT_LIMIT) : -LOGIT_LIMIT;
}

uint8_t edgeDecoderStep(edgeDecoder_t *decoder, const float logits[3], bool airborne) {
  const decoderConfig_t *config = &decoder->config;
  const float over = limited(logits[0]);
  if (!airborne) {
    decoder->airborne = 0;
    forget(decoder);
    return 0;
  }
  decoder->airborne++;
  decoder->slow += config->smoothGain * (over - decoder->slow);
  decoder->since += decoder->since < LONG_AGO ? 1 : 0;
  if (decoder->airborne < config->armSteps || decoder->since < config->dwellSteps) {
    return 0;
  }
  const float now = limited(logits[decoder->over ? 2 : 1]);
  const float support = config->overShare * (decoder->over ? -over : over);
  const bool event = now + support > (decoder->over ? config->exitScore : config->entryScore);
  const bool late = decoder->over ? decoder->slow < config->lateExit : decoder->slow > config->lateEntry;
  if (!event && !late) {
    return 0;
  }
  decoder->over = !decoder->over;
  decoder->since = 0;
  decoder->slow = 0.0f;
  return decoder->over ? 1 : 2;
}
