/**
 * @file app_edges.h
 * How the answers of network and FR-CFAR become the log's edges. Called by the core alone.
 */
#pragma once

#include "app_core.h"

/** Whether edges without a recent FR-CFAR alert are dropped. */
bool appFilters(const appCore_t *core);

/** An edge of a kind, now: EDGE_ENTRY, EDGE_EXIT, or 3 (EDGE_UNKNOWN). */
void appReport(appCore_t *core, uint8_t kind);

/** Logistic function. */
float appSigmoid(float x);

/**
 * The logits of one step of the streaming network become log values and, where they say so, an edge.
 * @param airborne  whether the drone flew at the step's sample
 * @param edge      what the decoder made of the logits
 */
void appTakeLogits(appCore_t *core, const float logits[EDGE_DECODER_LOGITS], bool airborne, uint8_t edge);

/** A step of `best` on the STM32, over the sample that the pipeline holds. */
void appStepBest(appCore_t *core);

/** A step of FR-CFAR alone: the alert itself is the edge; its kind is not known. */
void appStepCfar(appCore_t *core, const edgeEvent_t *event);
