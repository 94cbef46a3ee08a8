#include "app_local.h"

#include <string.h>

/**
 * The sample to begin with: a window of the past before the sample that no answer has come for yet, so that every
 * sample since the last answer is answered too. Without an answer: what the network needs before its first one.
 */
static uint32_t firstSample(const linkSender_t *link, const streamInt8_t *network) {
  const uint32_t kept = link->samples < LINK_HISTORY ? link->samples : LINK_HISTORY;
  const uint32_t unanswered = link->answered ? link->samples - 1 - link->lastAnswer : 0;
  const uint32_t wanted = link->answered ? unanswered + streamInt8Window(network) - 1 : link->refill;
  const uint32_t stride = (uint32_t)network->stride;
  const uint32_t first = link->samples - (wanted < kept ? wanted : kept);
  return (first + stride - 1) / stride * stride;  // computed on the same samples as on the GAP8
}

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
  local->next = firstSample(link, best->network);
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
