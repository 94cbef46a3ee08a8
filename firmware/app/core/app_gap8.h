/**
 * @file app_gap8.h
 * What the app sends to the GAP8, what comes back, and what runs here while nothing does. Called by the core alone.
 */
#pragma once

#include "app_core.h"

/** Sends the streaming network's inputs, quantised here as the network on the STM32 would. */
void appSendChannels(appCore_t *core);

/** While the GAP8 is silent the streaming network runs here, over the samples that were meant for it. */
void appRunLocal(appCore_t *core);

/** Sends the three fused features that the paper's networks take. */
void appSendFeatures(appCore_t *core, const edgeEvent_t *event);
