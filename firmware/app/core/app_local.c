#include "app_local.h"

#include <string.h>

void appLocalUpdate(appLocal_t *local, const linkSender_t *link, streamDetector_t *best, int8_t *arena) {
  if (link->state == LINK_UP && link->silent < APP_LOCAL_AFTER) {
    local->missing = 0;
    local->runs = false;
    return;
  }
  local->missing = (uint16_t)(local->missing + (local->missing < UINT16_MAX ? 1 : 0));
  const bool wait = local->missing < APP_LOCAL_AFTER && link->silent < APP_LOCAL_AFTER;
  if (local->runs || wait) {
    return;
  }
  const uint32_t held = link->samples < link->refill ? link->samples : link->refill;
  const uint32_t stride = (uint32_t)best->network->stride;
  local->next = (link->samples - held + stride - 1) / stride * stride;  // computed on the same samples as on the GAP8
  local->filled = 0;
  local->runs = true;
  streamInt8Reset(best->network, &best->state, arena);
}

bool appLocalStep(appLocal_t *local, const linkSender_t *link, streamDetector_t *best, linkAnswer_t *answer,
                  bool *answered) {
  *answered = false;
  if (!local->runs || edgeLinkAfter(link->samples, local->next) <= 0) {
    return false;
  }
  const int8_t *sample = (const int8_t *)link->history[local->next % LINK_HISTORY];
  const int8_t *output = streamInt8Step(best->network, &best->state, sample);
  answer->sequence = local->next++;
  local->filled += local->filled < UINT32_MAX ? 1 : 0;
  if (output != NULL && local->filled >= streamInt8Window(best->network)) {
    memcpy(answer->output, output, EDGE_LINK_OUTPUTS);
    *answered = true;
  }
  return true;
}
