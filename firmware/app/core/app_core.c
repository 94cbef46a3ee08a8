#include "app_core.h"

#include <string.h>

#include "app_edges.h"
#include "app_gap8.h"
#include "app_level.h"
#include "app_log.h"

static void runDetector(appCore_t *core, const edgeEvent_t *event) {
  switch (core->detector) {
    case APP_BEST: appStepBest(core); break;
    case APP_BEST_GAP8:
      appSendChannels(core);
      appRunLocal(core);
      break;
    case APP_PAPER_GAP8:
    case APP_PAPER_STREAM_GAP8:
      if (event->ready) {
        appSendFeatures(core, event);
      }
      if (!event->armed) {
        core->log.over = 0;  // the decoder forgets on the ground
      }
      if (event->edge != EDGE_NONE) {
        appReport(core, event->edge);
      }
      break;
    default: appStepCfar(core, event); break;
  }
}

/** The complementary estimator gives no horizontal acceleration: it stays 0, or what another one gave last. */
static void watchHorizontal(appCore_t *core, const appSample_t *sample) {
  const bool same = sample->acc[0] == core->horizontal[0] && sample->acc[1] == core->horizontal[1];
  if (!same || sample->accInBody || core->pipeline.airborneSteps == 0) {
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
  core->log.health = appHealthStep(core);
  const bool reported = core->reported;
  core->reported = false;
  return reported;
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
