#include "app_gap8.h"

#include <string.h>

#include "app_edges.h"
#include "app_log.h"
#include "app_paper.h"

_Static_assert(EDGE_DECODER_LOGITS <= EDGE_LINK_OUTPUTS && MOTION_CHANNELS <= EDGE_LINK_SAMPLE_BYTES,
               "the packets have room for channels and logits");

static void setAirborne(appCore_t *core, uint32_t sequence, bool airborne) {
  const uint32_t at = sequence % LINK_HISTORY;
  const uint32_t bit = UINT32_C(1) << (at % 32);
  core->airborneBits[at / 32] = airborne ? core->airborneBits[at / 32] | bit : core->airborneBits[at / 32] & ~bit;
}

static bool wasAirborne(const appCore_t *core, uint32_t sequence) {
  const uint32_t at = sequence % LINK_HISTORY;
  return (core->airborneBits[at / 32] >> (at % 32)) & 1u;
}

static void takeAnswer(appCore_t *core, const linkAnswer_t *answer) {
  const uint32_t lag = core->link.samples - 1 - answer->sequence;
  core->log.lag = (uint16_t)(lag < UINT16_MAX ? lag : UINT16_MAX);
  const appPaper_t *paper = appPaperOf(core->detector);
  if (paper != NULL) {
    const float difference = (float)(answer->output[0] - answer->output[1]);
    core->probability = appSigmoid(-paper->outputScale * difference);
    core->log.probability = core->probability;
    core->log.answers++;
    return;
  }
  const streamQuantisation_t *quantisation = &core->best.quantisation;
  for (int i = 0; i < EDGE_DECODER_LOGITS; i++) {
    core->best.logits[i] = quantisation->outputScale * (float)(answer->output[i] - quantisation->outputZeroPoint);
  }
  const bool airborne = lag < LINK_HISTORY && wasAirborne(core, answer->sequence);
  const uint8_t edge = edgeDecoderStep(&core->best.decoder, core->best.logits, airborne);
  appTakeLogits(core, core->best.logits, airborne, edge);
}

void appSendChannels(appCore_t *core) {
  const float *held = core->pipeline.held;
  float channels[MOTION_CHANNELS];
  int8_t quantised[EDGE_LINK_SAMPLE_BYTES];
  motionChannelsStep(&core->best.motion, held + HELD_ACC, held + HELD_GYRO, held + HELD_PWM, channels);
  streamQuantise(&core->best.quantisation, channels, MOTION_CHANNELS, quantised);
  setAirborne(core, core->link.samples, core->best.motion.airborneSteps > 0);
  linkSenderPush(&core->link, (const uint8_t *)quantised);
}

void appRunLocal(appCore_t *core) {
  linkAnswer_t answer;
  bool answered;
  appLocalUpdate(&core->local, &core->link, &core->best, core->arena);
  for (int i = 0; i < APP_LOCAL_SAMPLES; i++) {
    if (!appLocalStep(&core->local, &core->link, &core->best, &answer, &answered)) {
      return;
    }
    if (answered && linkSenderAccept(&core->link, answer.sequence)) {
      takeAnswer(core, &answer);
    }
  }
}

void appSendFeatures(appCore_t *core, const edgeEvent_t *event) {
  uint8_t sample[EDGE_LINK_SAMPLE_BYTES];
  _Static_assert(sizeof event->features == EDGE_LINK_SAMPLE_BYTES, "three features are a sample");
  memcpy(sample, event->features, sizeof sample);  // both processors are little endian
  linkSenderPush(&core->link, sample);
}

void appCoreReceive(appCore_t *core, const uint8_t *bytes, uint16_t length) {
  linkAnswer_t answers[EDGE_LINK_ANSWERS];
  if (!core->params.enable || !appUsesGap8(core)) {
    return;
  }
  const int count = linkSenderTake(&core->link, bytes, length, answers);
  for (int i = 0; i < count; i++) {
    takeAnswer(core, &answers[i]);
  }
}

uint16_t appCoreOutgoing(appCore_t *core, uint8_t *bytes) {
  return core->params.enable && appUsesGap8(core) ? linkSenderPoll(&core->link, bytes) : 0;
}

void appCoreSent(appCore_t *core, bool taken) {
  linkSenderSent(&core->link, taken);
  if (!taken) {
    appHappened(core, EVENT_DROPPED);
  }
}
