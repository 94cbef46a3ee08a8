// What the app begins with, and what begins anew with which setting.
#include "app_core.h"

#include <math.h>
#include <string.h>

#include "app_edges.h"
#include "app_log.h"
#include "app_paper.h"

static uint8_t detectorInForce(const appCore_t *core) {
  if (!core->networksFit) {
    return APP_CFAR;
  }
  if (core->haveGap8 || core->params.detector < APP_BEST_GAP8) {
    return core->params.detector;
  }
  return core->params.detector == APP_BEST_GAP8 ? APP_BEST : APP_CFAR;
}

/** Settings that the kernels read as they run. */
static void setThresholds(appCore_t *core) {
  appPaperDecoding(appPaperOf(core->detector), &core->params, &core->pipeline.config);
  core->pipeline.config.physicalFilter = appFilters(core);
  core->best.decoder.config.entryScore = core->params.scoreIn;
  core->best.decoder.config.exitScore = core->params.scoreOut;
}

static float bandLow(const appParams_t *params) { return params->bandMid - 0.5f * params->bandWidth; }

static float bandHigh(const appParams_t *params) { return params->bandMid + 0.5f * params->bandWidth; }

/** The pipeline cannot refuse its settings: appParamsClamp keeps each within what it takes. A test tries them. */
static void beginPipeline(appCore_t *core) {
  edgePipelineConfig_t config;
  edgePipelineDefaults(&config, &core->vehicle);
  config.armPwm = core->armPwm;
  config.lowHz = bandLow(&core->params);
  config.highHz = bandHigh(&core->params);
  config.pFa = core->params.pFa;
  (void)edgePipelineInit(&core->pipeline, &config);
  core->nonFinite = 0;
}

/** A new stream: its samples count from 0 anew, so a run of the network over the old one's ends with it. */
static void beginLink(appCore_t *core) {
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
  const appPaper_t *paper = appPaperOf(core->detector);
  edgeLinkDigest(paper ? paper->sha256 : AIRTOUCH_STREAM_SHA256, digest);
  const uint16_t refill =
      paper ? paper->refill : (uint16_t)(streamInt8Window(&airtouchStream) + airtouchStream.stride - 1);
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

/** What the detector found last is no longer so: nothing is known of it until the next step. */
static void forgetFindings(appLog_t *log) {
  memset(log->feature, 0, sizeof log->feature);
  memset(log->force, 0, sizeof log->force);
  memset(log->logit, 0, sizeof log->logit);
  log->cfarPower = 0.0f;
  log->threshold = NAN;
  log->probability = NAN;
  log->alert = 0;
  log->over = 0;
}

/** Kernels, detector and stream begin anew; counters stay. */
static void beginDetector(appCore_t *core) {
  core->networksFit = beginBest(core) && core->networksFit;
  core->detector = detectorInForce(core);
  core->log.detector = core->detector;
  forgetFindings(&core->log);
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
  if (params != NULL) {
    core->params = *params;
    core->log.paramErrors = appParamsClamp(&core->params);
  }
  setVehicle(core, &airtouchStreamMotion.vehicle, airtouchStreamMotion.armPwm);
  beginDetector(core);
}

void appCoreSetVehicle(appCore_t *core, const airtouchVehicle_t *vehicle, float armPwm) {
  setVehicle(core, vehicle, armPwm);
  beginDetector(core);
}

/** Networks of the band's features begin a new stream with another band. `best` uses no band. */
static void changeBand(appCore_t *core) {
  (void)edgePipelineSetBand(&core->pipeline, bandLow(&core->params), bandHigh(&core->params));
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
    beginDetector(core);
    return errors;
  }
  if (params->bandMid != old.bandMid || params->bandWidth != old.bandWidth) {
    changeBand(core);
  }
  if (params->pFa != old.pFa) {
    (void)edgePipelineSetFalseAlarm(&core->pipeline, params->pFa);
  }
  setThresholds(core);
  return errors;
}
