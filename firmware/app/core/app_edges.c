#include "app_edges.h"

#include <math.h>
#include <string.h>

#include "app_paper.h"

enum { EDGE_UNKNOWN = 3 };

bool appFilters(const appCore_t *core) {
  return core->params.filter == APP_FILTER_ON ||
         (core->params.filter == APP_FILTER_AS_TRAINED && appPaperOf(core->detector) != NULL);
}

void appReport(appCore_t *core, uint8_t kind) {
  core->log.edge = kind;
  core->log.edges++;
  core->log.edgeSample = core->log.samples;
  if (kind != EDGE_UNKNOWN) {
    core->log.over = kind == EDGE_ENTRY;
  }
  core->reported = true;
}

float appSigmoid(float x) { return 1.0f / (1.0f + expf(-x)); }

void appTakeLogits(appCore_t *core, const float logits[EDGE_DECODER_LOGITS], bool airborne, uint8_t edge) {
  memcpy(core->log.logit, logits, sizeof core->log.logit);
  core->log.probability = airborne ? appSigmoid(logits[0]) : 0.0f;
  core->log.answers++;
  if (!airborne) {
    core->log.over = 0;  // the decoder forgets on the ground
  }
  const bool vouched = core->pipeline.sinceAlert < core->pipeline.config.alertHold;
  if (edge != EDGE_NONE && (vouched || !appFilters(core))) {
    appReport(core, edge);
  }
}

void appStepBest(appCore_t *core) {
  const float *held = core->pipeline.held;
  streamEvent_t event;
  streamDetectorStep(&core->best, held + HELD_ACC, held + HELD_GYRO, held + HELD_PWM, &event);
  if (event.ready) {
    appTakeLogits(core, event.logits, event.airborne, event.edge);
  }
}

void appStepCfar(appCore_t *core, const edgeEvent_t *event) {
  core->sinceEdge = (uint16_t)(core->sinceEdge + (core->sinceEdge < UINT16_MAX ? 1 : 0));
  if (event->alert && !core->wasAlert && event->armed && core->sinceEdge >= AIRTOUCH_DWELL_SAMPLES) {
    core->sinceEdge = 0;
    appReport(core, EDGE_UNKNOWN);
  }
  core->wasAlert = event->alert;
}
