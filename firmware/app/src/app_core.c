#include "app_core.h"

#include <math.h>
#include <string.h>

#include "app_level.h"
#include "app_log.h"
#include "app_paper.h"
#include "stream_window.h"

_Static_assert(EDGE_DECODER_LOGITS <= EDGE_LINK_OUTPUTS && MOTION_CHANNELS <= EDGE_LINK_SAMPLE_BYTES,
               "the packets have room for channels and logits");

enum { EDGE_UNKNOWN = 3 };

static uint8_t detectorInForce(const appCore_t *core) {
  if (!core->networksFit) {
    return APP_CFAR;
  }
  if (core->haveGap8 || core->params.detector < APP_BEST_GAP8) {
    return core->params.detector;
  }
  return core->params.detector == APP_BEST_GAP8 ? APP_BEST : APP_CFAR;
}

static bool filters(const appCore_t *core) {
  return core->params.filter == APP_FILTER_ON ||
         (core->params.filter == APP_FILTER_AS_TRAINED && appPaperOf(core->detector) != NULL);
}

/** Settings that the kernels read as they run. */
static void setThresholds(appCore_t *core) {
  appPaperDecoding(appPaperOf(core->detector), &core->params, &core->pipeline.config);
  core->pipeline.config.physicalFilter = filters(core);
  core->best.decoder.config.entryScore = core->params.scoreIn;
  core->best.decoder.config.exitScore = core->params.scoreOut;
}

static float bandLow(const appParams_t *params) { return params->bandMid - 0.5f * params->bandWidth; }

static float bandHigh(const appParams_t *params) { return params->bandMid + 0.5f * params->bandWidth; }

static void beginPipeline(appCore_t *core) {
  edgePipelineConfig_t config;
  edgePipelineDefaults(&config, &core->vehicle);
  config.armPwm = core->armPwm;
  config.lowHz = bandLow(&core->params);
  config.highHz = bandHigh(&core->params);
  config.pFa = core->params.pFa;
  edgePipelineInit(&core->pipeline, &config);
  core->nonFinite = 0;
}

/** A new stream: its samples count from 0 anew, so a run of the network over the old one's ends with it. */
static void beginLink(appCore_t *core) {
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
  const appPaper_t *paper = appPaperOf(core->detector);
  edgeLinkDigest(paper ? paper->sha256 : AIRTOUCH_STREAM_SHA256, digest);
  const uint16_t refill = paper ? paper->refill : (uint16_t)(streamWindow(&airtouchStream) + airtouchStream.stride - 1);
  const uint8_t session = (uint8_t)(core->link.session == 255 ? 1 : core->link.session + 1);
  const linkCounters_t counters = core->link.counters;
  linkSenderInit(&core->link, paper ? paper->algorithm : EDGE_LINK_BEST, digest, refill, core->nonce, session);
  core->link.counters = counters;
  core->local = (appLocal_t){0};
}

/** Sets `best` up; false where its network is not one that the detector takes, or has no room here. */
static bool beginBest(appCore_t *core) {
  return streamInt8Check(&airtouchStream) < 0 &&
         (uint32_t)streamInt8ArenaBytes(&airtouchStream) <= sizeof core->arena &&
         streamDetectorInit(&core->best, &airtouchStreamMotion, &airtouchStream, &airtouchStreamQuantisation,
                            &airtouchStreamDecoder, core->arena);
}

/** Kernels, detector and stream begin anew; counters stay. */
static void begin(appCore_t *core) {
  core->networksFit = beginBest(core) && core->networksFit;
  core->detector = detectorInForce(core);
  core->log.detector = core->detector;
  core->log.over = 0;
  core->log.probability = NAN;
  core->probability = NAN;
  core->wasAlert = false;
  core->sinceEdge = UINT16_MAX;
  core->still = 0;
  beginPipeline(core);
  beginLink(core);
  setThresholds(core);
}

static void setVehicle(appCore_t *core, const airtouchVehicle_t *vehicle, float armPwm) {
  const airtouchVehicle_t *trained = &airtouchStreamMotion.vehicle;
  core->vehicle = *vehicle;
  core->armPwm = armPwm;
  core->networksFit = vehicle->gravity == trained->gravity && armPwm == airtouchStreamMotion.armPwm;
  for (int i = 0; i < 3; i++) {
    core->networksFit = core->networksFit && vehicle->thrust[i] == trained->thrust[i];
  }
}

void appCoreInit(appCore_t *core, const appParams_t *params, bool haveGap8, uint32_t nonce) {
  memset(core, 0, sizeof *core);
  memset(core->since, 0xff, sizeof core->since);
  core->haveGap8 = haveGap8;
  core->nonce = nonce;
  appParamsDefaults(&core->params);
  core->log.threshold = NAN;
  if (params != NULL) {
    core->params = *params;
    core->log.paramErrors = appParamsClamp(&core->params);
  }
  setVehicle(core, &airtouchStreamMotion.vehicle, airtouchStreamMotion.armPwm);
  begin(core);
}

void appCoreSetVehicle(appCore_t *core, const airtouchVehicle_t *vehicle, float armPwm) {
  setVehicle(core, vehicle, armPwm);
  begin(core);
}

/** Networks of the band's features begin a new stream with another band. `best` uses no band. */
static void changeBand(appCore_t *core) {
  edgePipelineSetBand(&core->pipeline, bandLow(&core->params), bandHigh(&core->params));
  if (appPaperOf(core->detector) != NULL) {
    core->probability = NAN;
    core->log.probability = NAN;
    beginLink(core);
  }
}

uint16_t appCoreSetParams(appCore_t *core, appParams_t *params) {
  const appParams_t old = core->params;
  const uint16_t errors = appParamsClamp(params);
  if (errors > 0) {
    core->log.paramErrors = (uint16_t)(core->log.paramErrors + errors);
    appHappened(core, EVENT_PARAM);
  }
  core->params = *params;
  if (params->detector != old.detector || params->enable != old.enable) {
    begin(core);
    return errors;
  }
  if (params->bandMid != old.bandMid || params->bandWidth != old.bandWidth) {
    changeBand(core);
  }
  if (params->pFa != old.pFa) {
    edgePipelineSetFalseAlarm(&core->pipeline, params->pFa);
  }
  setThresholds(core);
  return errors;
}

static void report(appCore_t *core, uint8_t kind) {
  core->log.edge = kind;
  core->log.edges++;
  core->log.edgeSample = core->log.samples;
  if (kind != EDGE_UNKNOWN) {
    core->log.over = kind == EDGE_ENTRY;
  }
  core->reported = true;
}

static float sigmoid(float x) { return 1.0f / (1.0f + expf(-x)); }

/** The logits of one step of the streaming network become log values and, where they say so, an edge. */
static void takeLogits(appCore_t *core, const float logits[EDGE_DECODER_LOGITS], bool airborne, uint8_t edge) {
  memcpy(core->log.logit, logits, sizeof core->log.logit);
  core->log.probability = airborne ? sigmoid(logits[0]) : 0.0f;
  core->log.answers++;
  const bool vouched = core->pipeline.sinceAlert < core->pipeline.config.alertHold;
  if (edge != EDGE_NONE && (vouched || !filters(core))) {
    report(core, edge);
  }
}

static void setAirborne(appCore_t *core, uint32_t sequence, bool airborne) {
  const uint32_t at = sequence % LINK_HISTORY;
  const uint32_t bit = UINT32_C(1) << (at % 32);
  core->airborneBits[at / 32] = airborne ? core->airborneBits[at / 32] | bit : core->airborneBits[at / 32] & ~bit;
}

static bool wasAirborne(const appCore_t *core, uint32_t sequence) {
  const uint32_t at = sequence % LINK_HISTORY;
  return (core->airborneBits[at / 32] >> (at % 32)) & 1u;
}

static void stepBest(appCore_t *core) {
  const float *held = core->pipeline.held;
  streamEvent_t event;
  streamDetectorStep(&core->best, held, held + 3, held + 6, &event);
  if (event.ready) {
    takeLogits(core, event.logits, event.airborne, event.edge);
  }
}

static void takeAnswer(appCore_t *core, const linkAnswer_t *answer) {
  const uint32_t lag = core->link.samples - 1 - answer->sequence;
  core->log.lag = (uint16_t)(lag < UINT16_MAX ? lag : UINT16_MAX);
  const appPaper_t *paper = appPaperOf(core->detector);
  if (paper != NULL) {
    const float difference = (float)(answer->output[0] - answer->output[1]);
    core->probability = sigmoid(-paper->outputScale * difference);
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
  takeLogits(core, core->best.logits, airborne, edge);
}

/** The streaming network's inputs, quantised here as the network on the STM32 would. */
static void sendChannels(appCore_t *core) {
  const float *held = core->pipeline.held;
  float channels[MOTION_CHANNELS];
  int8_t quantised[EDGE_LINK_SAMPLE_BYTES];
  motionChannelsStep(&core->best.motion, held, held + 3, held + 6, channels);
  streamQuantise(&core->best.quantisation, channels, MOTION_CHANNELS, quantised);
  setAirborne(core, core->link.samples, core->best.motion.airborne > 0);
  linkSenderPush(&core->link, (const uint8_t *)quantised);
}

/** While the GAP8 is silent the network runs here, over the samples that were meant for it. */
static void runLocal(appCore_t *core) {
  linkAnswer_t answer;
  bool answered;
  appLocalBegin(&core->local, &core->link, &core->best, core->arena);
  for (int i = 0; i < APP_LOCAL_SAMPLES; i++) {
    if (!appLocalStep(&core->local, &core->link, &core->best, &answer, &answered)) {
      return;
    }
    if (answered && linkSenderAccept(&core->link, answer.sequence)) {
      takeAnswer(core, &answer);
    }
  }
}

static void sendFeatures(appCore_t *core, const edgeEvent_t *event) {
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

/** The alert itself is the edge: its kind is not known. */
static void stepCfar(appCore_t *core, const edgeEvent_t *event) {
  core->sinceEdge = (uint16_t)(core->sinceEdge + (core->sinceEdge < UINT16_MAX ? 1 : 0));
  if (event->alert && !core->wasAlert && event->armed && core->sinceEdge >= AIRTOUCH_DWELL_SAMPLES) {
    core->sinceEdge = 0;
    report(core, EDGE_UNKNOWN);
  }
  core->wasAlert = event->alert;
}

static void runDetector(appCore_t *core, const edgeEvent_t *event) {
  switch (core->detector) {
    case APP_BEST: stepBest(core); break;
    case APP_BEST_GAP8:
      sendChannels(core);
      runLocal(core);
      break;
    case APP_PAPER_GAP8:
    case APP_PAPER_STREAM_GAP8:
      if (event->ready) {
        sendFeatures(core, event);
      }
      if (event->edge != EDGE_NONE) {
        report(core, event->edge);
      }
      break;
    default: stepCfar(core, event); break;
  }
}

/** The complementary estimator gives no horizontal acceleration: it stays 0, or what another one gave last. */
static void watchHorizontal(appCore_t *core, const appSample_t *sample) {
  const bool same = sample->acc[0] == core->horizontal[0] && sample->acc[1] == core->horizontal[1];
  if (!same || sample->accInBody || core->pipeline.airborne == 0) {
    core->still = 0;
  } else if (core->still < APP_STILL_STEPS) {
    core->still++;
  }
  memcpy(core->horizontal, sample->acc, sizeof core->horizontal);
}

bool appCoreStep(appCore_t *core, const appSample_t *sample) {
  core->log.samples++;
  if (core->params.enable) {
    edgeSample_t level;
    edgeEvent_t event;
    appLevel(sample, &level);
    level.probability = core->probability;
    edgePipelineStep(&core->pipeline, &level, &event);
    appLogEvent(core, &event);
    watchHorizontal(core, sample);
    runDetector(core, &event);
    appLogLink(core);
  }
  core->log.health = appHealthOf(core);
  const bool reported = core->reported;
  core->reported = false;
  return reported;
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

void appCoreTime(appCore_t *core, uint32_t microseconds, bool late) {
  core->log.load = (uint16_t)(microseconds < UINT16_MAX ? microseconds : UINT16_MAX);
  core->log.loadMax = core->log.load > core->log.loadMax ? core->log.load : core->log.loadMax;
  if (late) {
    core->log.late++;
    appHappened(core, EVENT_LATE);
  }
}

void appCoreNoSensor(appCore_t *core) { core->noSensor = true; }

bool appStalled(uint32_t now, uint32_t lastStep, uint32_t limit) {
  const int32_t age = (int32_t)(now - lastStep);
  return age > 0 && (uint32_t)age > limit;
}
