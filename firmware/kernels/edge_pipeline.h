/**
 * @file edge_pipeline.h
 * Everything from a sample to an edge, in one struct: band power (FC-FE), fused
 * features (CCS-FF), disturbance force, FR-CFAR, and the decoding of the
 * network's probability with the physical filter behind it.
 *
 * Channels: acc x, y, z; gyro x, y, z; PWM 2 - 1, 3 - 1, 4 - 1. Under 12 kB.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: edgePipeline_t alone, under 12 kB; 172 bytes of stack.
 * Cost: 4,300 instructions of a Cortex-M4 a sample, 4,520 at worst (`python -m tools.instruction_counts.count`).
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "airtouch_parameters.h"
#include "band_power.h"
#include "feature_window.h"
#include "fr_cfar.h"
#include "kernel_types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define EDGE_PIPELINE_CHANNELS 9
#define EDGE_PIPELINE_SENSORS 3

/** The largest settings that a build has room for; define them to change that. */
#ifndef EDGE_PIPELINE_MAX_WINDOW
#define EDGE_PIPELINE_MAX_WINDOW AIRTOUCH_BAND_WINDOW
#endif
#ifndef EDGE_PIPELINE_MAX_BINS
#define EDGE_PIPELINE_MAX_BINS 7
#endif
#ifndef EDGE_PIPELINE_MAX_CELLS
#define EDGE_PIPELINE_MAX_CELLS (AIRTOUCH_LEADING_WINDOW + AIRTOUCH_GUARD_CELLS)
#endif
#define EDGE_PIPELINE_BAND_FLOATS \
  BAND_POWER_FLOATS(EDGE_PIPELINE_MAX_WINDOW, EDGE_PIPELINE_CHANNELS, EDGE_PIPELINE_MAX_BINS)

/** Values of edgeEvent_t.edge. */
enum { EDGE_NONE = 0, EDGE_ENTRY = 1, EDGE_EXIT = 2 };

/** The pipeline. It points into itself: initialise it where it stays, never copy it. */
typedef struct {
  edgePipelineConfig_t config;
  bandPower_t band;
  frCfar_t cfar;
  exponentialMean_t forceMean;
  float held[HELD_VALUES];  ///< last finite acc, gyro, PWM
  float thrustAxis[3];      ///< last finite R e_z
  float voltageFactor;      ///< of the last known voltage
  float bandPower[EDGE_PIPELINE_CHANNELS];
  float features[EDGE_PIPELINE_SENSORS];
  uint32_t nonFinite;   ///< values replaced so far
  uint32_t sinceAlert;  ///< samples, EDGE_NEVER before any
  uint32_t sinceEdge;
  uint32_t airborneSteps;  ///< samples in the air without a break
  bool over;               ///< the decoder's state: over a platform
  float bandStorage[EDGE_PIPELINE_BAND_FLOATS];
  float cfarStorage[EDGE_PIPELINE_MAX_CELLS];
} edgePipeline_t;

/**
 * Fills @p config with the defaults and this @p vehicle. The settings of the paper's section 7.1 where it gives one
 * (rate, window, band, P_FA, cells); the project's own where kernel_types.h marks them.
 */
void edgePipelineDefaults(edgePipelineConfig_t *config, const airtouchVehicle_t *vehicle);

/**
 * Sets a pipeline up; the settings are copied.
 * @return false for settings out of range or larger than this build's room; a threshold that is NaN (armPwm,
 *         probabilityEntry, probabilityExit) is taken, and never reached
 */
bool edgePipelineInit(edgePipeline_t *pipeline, const edgePipelineConfig_t *config);

/**
 * Another band: the band power begins anew, so features are NaN until a window has passed; nothing else changes.
 * @return false, with nothing changed, for a band out of range or larger than this build's room
 * Costs 2 N sines, as the start does.
 */
bool edgePipelineSetBand(edgePipeline_t *pipeline, float lowHz, float highHz);

/** Another probability of false alarm, in force at once. @return false, nothing changed, unless FLT_MIN <= pFa < 1 */
bool edgePipelineSetFalseAlarm(edgePipeline_t *pipeline, float pFa);

/**
 * Takes one sample and says what it means.
 * @param event  every field is written
 * @return whether an edge is reported at this sample
 * Never fails: values that are not finite hold the last finite one.
 */
bool edgePipelineStep(edgePipeline_t *pipeline, const edgeSample_t *sample, edgeEvent_t *event);

#ifdef __cplusplus
}
#endif
