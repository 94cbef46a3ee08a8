#include "edge_decoder.h"

#include "sample_guard.h"

// A magnitude: probabilities of 0.0003 and 0.9997. One wild logit moves the smoothed one no further than that.
#define LOGIT_LIMIT 8.0f
// The smoothed logit before anything is known: over a platform with a probability of 0.05.
#define SMOOTHED_AT_START (-3.0f)
// Steps at which the count since the last edge stops, 248 days at 50 Hz: "never yet", and far from wrapping.
#define LONG_AGO 0x3fffffffu

static void forget(edgeDecoder_t *decoder) {
  decoder->smoothedOver = SMOOTHED_AT_START;
  decoder->since = LONG_AGO;
  decoder->over = false;
  decoder->waiting = 0;
  for (int i = 0; i < EDGE_DECODER_RING; i++) {
    decoder->recent[0][i] = -LOGIT_LIMIT;
    decoder->recent[1][i] = -LOGIT_LIMIT;
  }
}

void edgeDecoderInit(edgeDecoder_t *decoder, const decoderConfig_t *config) {
  decoder->config = *config;
  if (decoder->config.lookBack >= EDGE_DECODER_RING) {
    decoder->config.lookBack = EDGE_DECODER_RING - 1;
  }
  decoder->airborneSteps = 0;
  decoder->newest = 0;
  decoder->due = 0;
  decoder->peak = -LOGIT_LIMIT;
  forget(decoder);
}

static float limited(float logit) {
  return logit == logit ? clampFloat(logit, -LOGIT_LIMIT, LOGIT_LIMIT) : -LOGIT_LIMIT;
}

static void remember(edgeDecoder_t *decoder, float entry, float leave) {
  decoder->newest = (decoder->newest + 1) % EDGE_DECODER_RING;
  decoder->recent[0][decoder->newest] = entry;
  decoder->recent[1][decoder->newest] = leave;
}

/** Steps since the event logit of this kind peaked, the latest of equal peaks. */
static uint32_t findPeak(edgeDecoder_t *decoder, int kind) {
  uint32_t back = 0;
  decoder->peak = -LOGIT_LIMIT - 1.0f;
  for (uint32_t i = 0; i <= decoder->config.lookBack; i++) {
    const uint32_t at = (decoder->newest + EDGE_DECODER_RING - i) % EDGE_DECODER_RING;
    if (decoder->recent[kind][at] > decoder->peak) {
      decoder->peak = decoder->recent[kind][at];
      back = i;
    }
  }
  return back;
}

/** Whether an edge is seen at this step. */
static bool fires(const edgeDecoder_t *decoder, float over) {
  const decoderConfig_t *config = &decoder->config;
  const float now = decoder->recent[decoder->over ? 1 : 0][decoder->newest];
  const float support = config->overShare * (decoder->over ? -over : over);
  const bool event = now + support > (decoder->over ? config->exitScore : config->entryScore);
  const bool late =
      decoder->over ? decoder->smoothedOver < config->lateExit : decoder->smoothedOver > config->lateEntry;
  return event || late;
}

/** The edge that waits moves to a higher peak, or comes nearer to its time. */
static void wait(edgeDecoder_t *decoder) {
  const float now = decoder->recent[decoder->waiting - 1][decoder->newest];
  if (now > decoder->peak) {
    decoder->peak = now;
    decoder->due = decoder->config.holdSteps;
  } else if (decoder->due > 0) {
    decoder->due--;
  }
}

uint8_t edgeDecoderStep(edgeDecoder_t *decoder, const float logits[EDGE_DECODER_LOGITS], bool airborne) {
  const decoderConfig_t *config = &decoder->config;
  if (!airborne) {
    decoder->airborneSteps = 0;
    forget(decoder);
    return 0;
  }
  const float over = limited(logits[0]);
  remember(decoder, limited(logits[1]), limited(logits[2]));
  decoder->airborneSteps++;
  decoder->smoothedOver += config->smoothGain * (over - decoder->smoothedOver);
  decoder->since += decoder->since < LONG_AGO ? 1 : 0;
  if (decoder->waiting) {
    wait(decoder);
  }
  uint8_t reported = 0;
  const bool ready = decoder->airborneSteps >= config->armSteps && decoder->since >= config->dwellSteps;
  if (ready && fires(decoder, over)) {
    reported = decoder->waiting;  // an edge that still waits is not held up by the next one
    const uint32_t back = findPeak(decoder, decoder->over ? 1 : 0);
    decoder->due = config->holdSteps > back ? config->holdSteps - back : 0;
    decoder->over = !decoder->over;
    decoder->waiting = decoder->over ? 1 : 2;
    decoder->since = 0;
    decoder->smoothedOver = 0.0f;
  }
  if (!reported && decoder->waiting && decoder->due == 0) {
    reported = decoder->waiting;
    decoder->waiting = 0;
  }
  return reported;
}
