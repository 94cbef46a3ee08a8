/**
 * @file app_log.h
 * The log values of the app's core, and its health. Called by the core alone.
 */
#pragma once

#include "app_core.h"

/** What sets a health flag for a second. */
typedef enum { EVENT_NON_FINITE, EVENT_PARAM, EVENT_DROPPED, EVENT_LATE } appEvent_t;

/** Whether the detector in force runs on the GAP8. */
bool appUsesGap8(const appCore_t *core);

/** Notes an event. */
void appHappened(appCore_t *core, appEvent_t event);

/** What the pipeline found at this step. */
void appLogEvent(appCore_t *core, const edgeEvent_t *event);

/** The link's counters; takes the probability back where the last answer is too old. */
void appLogLink(appCore_t *core);

/** A step of health: the flags of now, and each event is a step older. */
uint16_t appHealthStep(appCore_t *core);
