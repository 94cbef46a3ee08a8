/**
 * @file app_local.h
 * `best` on the STM32 while the GAP8 is silent. The samples that were meant for the GAP8 are
 * still there, so the same network runs over them here: first over the window before the first
 * unanswered one, a few samples a step, then over each new one. Its answers are those that the GAP8 would give.
 */
#pragma once

#include "link_sender.h"
#include "stream_detector.h"

#define APP_LOCAL_AFTER 25   ///< steps of silence until the network runs here; no source: round number
#define APP_LOCAL_SAMPLES 8  ///< a step, at most, while it catches up: about 2 ms

/** Where it stands; plain values. */
typedef struct {
  uint32_t next;     ///< sequence of the next sample to use
  uint32_t filled;   ///< samples used since it began
  uint16_t missing;  ///< steps since the GAP8 last gave answers
  bool runs;
} appLocal_t;

/** Once a step, before appLocalStep(): begins or ends the run as the link's state says. @param arena  the network's */
void appLocalUpdate(appLocal_t *local, const linkSender_t *link, streamDetector_t *best, int8_t *arena);

/**
 * Uses one sample of the link's history.
 * @param answer    the network's outputs at it
 * @param answered  whether it has any: the network computes on every stride-th sample of a full window
 * @return whether there was a sample
 */
bool appLocalStep(appLocal_t *local, const linkSender_t *link, streamDetector_t *best, linkAnswer_t *answer,
                  bool *answered);
