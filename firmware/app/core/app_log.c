#include "app_log.h"

#include <math.h>
#include <string.h>

bool appUsesGap8(const appCore_t *core) { return core->detector >= APP_BEST_GAP8; }

void appHappened(appCore_t *core, appEvent_t event) { core->since[event] = 0; }

void appLogEvent(appCore_t *core, const edgeEvent_t *event) {
  appLog_t *log = &core->log;
  memcpy(log->feature, event->features, sizeof log->feature);
  memcpy(log->force, event->force, sizeof log->force);
  log->cfarPower = event->cfarPower;
  log->threshold = event->threshold;
  log->alert = event->alert;
  if (event->nonFinite != core->nonFinite) {
    appHappened(core, EVENT_NON_FINITE);
    log->nonFinite += event->nonFinite - core->nonFinite;
    core->nonFinite = event->nonFinite;
  }
}

void appLogLink(appCore_t *core) {
  const linkCounters_t *counters = &core->link.counters;
  appLog_t *log = &core->log;
  log->dropped = counters->packetsDropped;
  log->lost = counters->samplesLost;
  log->timeouts = counters->timeouts;
  log->gap8Resets = counters->resets;
  log->gap8Uptime = counters->uptimeMs;
  log->link = core->link.state;
  const linkSender_t *link = &core->link;
  if (appUsesGap8(core) && !(link->answered && link->samples - link->lastAnswer <= APP_ANSWER_STEPS)) {
    log->probability = NAN;
    core->probability = NAN;
  }
  log->detector = core->local.runs && core->detector == APP_BEST_GAP8 ? APP_BEST : core->detector;
}

static uint16_t linkHealth(const appCore_t *core) {
  switch (core->link.state) {
    case LINK_UP: return 0;
    case LINK_FILLING: return APP_LINK_FILLING;
    case LINK_REFUSED: return APP_MODEL_REFUSED;
    default: return APP_LINK_DOWN;
  }
}

uint16_t appHealthStep(appCore_t *core) {
  static const uint16_t flags[APP_EVENTS] = {APP_NON_FINITE, APP_PARAM_CLAMPED, APP_DROPPED, APP_LATE};
  uint16_t health = core->params.enable && appUsesGap8(core) ? linkHealth(core) : 0;
  for (int i = 0; i < APP_EVENTS; i++) {
    health = (uint16_t)(health | (core->since[i] < APP_RECENT_STEPS ? flags[i] : 0));
    core->since[i] = (uint16_t)(core->since[i] + (core->since[i] < UINT16_MAX ? 1 : 0));
  }
  if (core->log.detector != core->params.detector) {
    health = (uint16_t)(health | (core->networksFit ? APP_NO_GAP8 : APP_OTHER_VEHICLE));
  }
  health = (uint16_t)(health | (core->still >= APP_STILL_STEPS ? APP_NO_HORIZONTAL : 0));
  return (uint16_t)(health | (core->noSensor ? APP_NO_SENSOR : 0));
}
