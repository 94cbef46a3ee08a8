#include "edge_pipeline.h"

#include <math.h>
#include <string.h>

#include "cross_spectrum.h"
#include "disturbance_force.h"
#include "sample_guard.h"

// Samples at which counts stop, 124 days: "never yet", far above any setting of 16 bits and far from wrapping.
#define EDGE_NEVER (UINT32_C(1) << 30)

static const uint16_t sensorAxes[EDGE_PIPELINE_SENSORS] = {3, 3, 3};

void edgePipelineDefaults(edgePipelineConfig_t *config, const airtouchVehicle_t *vehicle) {
  memset(config, 0, sizeof(*config));
  config->sampleRateHz = AIRTOUCH_SAMPLE_RATE_HZ;
  config->lowHz = AIRTOUCH_BAND_LOW_HZ;
  config->highHz = AIRTOUCH_BAND_HIGH_HZ;
  config->pFa = AIRTOUCH_P_FA;
  config->forceMeanSamples = AIRTOUCH_FORCE_MEAN_SAMPLES;
  config->armPwm = AIRTOUCH_ARM_PWM;
  config->probabilityEntry = AIRTOUCH_PROBABILITY_ENTRY;
  config->probabilityExit = AIRTOUCH_PROBABILITY_EXIT;
  config->window = AIRTOUCH_BAND_WINDOW;
  config->hop = AIRTOUCH_BAND_HOP;
  config->leadingWindow = AIRTOUCH_LEADING_WINDOW;
  config->guardCells = AIRTOUCH_GUARD_CELLS;
  config->alertHold = AIRTOUCH_ALERT_HOLD;
  config->armSamples = AIRTOUCH_ARM_SAMPLES;
  config->dwellSamples = AIRTOUCH_DWELL_SAMPLES;
  config->physicalFilter = 1;
  config->vehicle = *vehicle;
}

/** The band power of the settings, without a past. */
static bool beginBand(edgePipeline_t *pipeline) {
  const edgePipelineConfig_t *config = &pipeline->config;
  for (int c = 0; c < EDGE_PIPELINE_CHANNELS; c++) {
    pipeline->bandPower[c] = NAN;
  }
  for (int s = 0; s < EDGE_PIPELINE_SENSORS; s++) {
    pipeline->features[s] = NAN;
  }
  return bandPowerInit(&pipeline->band, config->sampleRateHz, config->window, config->lowHz, config->highHz,
                       config->hop, EDGE_PIPELINE_CHANNELS, pipeline->bandStorage, EDGE_PIPELINE_BAND_FLOATS);
}

bool edgePipelineInit(edgePipeline_t *pipeline, const edgePipelineConfig_t *config) {
  memset(pipeline, 0, sizeof(*pipeline));
  pipeline->config = *config;
  pipeline->thrustAxis[2] = 1.0f;
  pipeline->voltageFactor = 1.0f;
  pipeline->sinceAlert = EDGE_NEVER;
  pipeline->sinceEdge = EDGE_NEVER;
  if (!(config->forceMeanSamples > 0.0f) || !isfinite(config->forceMeanSamples)) {
    return false;
  }
  exponentialMeanInit(&pipeline->forceMean, config->forceMeanSamples);
  return beginBand(pipeline) && frCfarInit(&pipeline->cfar, config->leadingWindow, config->guardCells, config->pFa,
                                           pipeline->cfarStorage, EDGE_PIPELINE_MAX_CELLS);
}

bool edgePipelineSetBand(edgePipeline_t *pipeline, float lowHz, float highHz) {
  edgePipelineConfig_t *config = &pipeline->config;
  const size_t bins = bandPowerBins(config->sampleRateHz, config->window, lowHz, highHz, NULL);
  const size_t floats = BAND_POWER_FLOATS((size_t)config->window, (size_t)EDGE_PIPELINE_CHANNELS, bins);
  if (bins == 0 || floats > EDGE_PIPELINE_BAND_FLOATS) {
    return false;
  }
  config->lowHz = lowHz;
  config->highHz = highHz;
  return beginBand(pipeline);
}

bool edgePipelineSetFalseAlarm(edgePipeline_t *pipeline, float pFa) {
  if (!frCfarSetFalseAlarm(&pipeline->cfar, pFa)) {
    return false;
  }
  pipeline->config.pFa = pFa;
  return true;
}

/** Keeps the finite ones of @p count values within +-@p limit; returns how many were not finite. */
static uint32_t holdFinite(const float *value, int count, float limit, float *held) {
  uint32_t others = 0;
  for (int i = 0; i < count; i++) {
    others += isfinite(value[i]) ? 0u : 1u;
    guardWithin(value[i], limit, &held[i]);
  }
  return others;
}

/** Keeps the finite values of @p sample in the pipeline, counts the others. */
static void takeSample(edgePipeline_t *pipeline, const edgeSample_t *sample) {
  float *held = pipeline->held;
  pipeline->nonFinite += holdFinite(sample->acc, 3, ACC_LIMIT, held + HELD_ACC) +
                         holdFinite(sample->gyro, 3, RATE_LIMIT, held + HELD_GYRO) +
                         holdFinite(sample->pwm, 4, PWM_LIMIT, held + HELD_PWM);
  for (int i = HELD_PWM; i < HELD_VALUES; i++) {
    held[i] = held[i] > 0.0f ? held[i] : 0.0f;
  }
  holdFinite(sample->thrustAxis, 3, AXIS_LIMIT, pipeline->thrustAxis);
  if (voltageKnown(sample->vbat)) {
    pipeline->voltageFactor = voltageFactor(&pipeline->config.vehicle, sample->vbat);
  }
}

static bool findFeatures(edgePipeline_t *pipeline) {
  const float *held = pipeline->held;
  float channel[EDGE_PIPELINE_CHANNELS];
  memcpy(channel, held, HELD_PWM * sizeof(float));
  for (int i = 1; i < 4; i++) {
    channel[5 + i] = held[HELD_PWM + i] - held[HELD_PWM];
  }
  if (!bandPowerStep(&pipeline->band, channel, pipeline->bandPower)) {
    return false;
  }
  cascadedCrossSpectrum(pipeline->bandPower, sensorAxes, EDGE_PIPELINE_SENSORS, pipeline->features);
  return true;
}

/** The cell that FR-CFAR tests: the one place that chooses it. */
static float cfarInput(edgePipeline_t *pipeline, const edgeEvent_t *event) {
  if (pipeline->config.cfarNorm) {
    return event->forceNorm;
  }
  const float deviation = exponentialMeanStep(&pipeline->forceMean, event->force[2]);
  return deviation * deviation;
}

static void findForce(edgePipeline_t *pipeline, edgeEvent_t *event) {
  const edgePipelineConfig_t *config = &pipeline->config;
  const float thrust = totalThrust(&config->vehicle, pipeline->held + HELD_PWM) * pipeline->voltageFactor;
  disturbanceForce(&config->vehicle, pipeline->held + HELD_ACC, thrust, pipeline->thrustAxis, event->force);
  event->forceNorm = forceNorm(event->force);
  event->cfarPower = cfarInput(pipeline, event);
  event->alert = frCfarStep(&pipeline->cfar, event->cfarPower, &event->threshold);
  if (event->alert) {
    pipeline->sinceAlert = 0;
  } else if (pipeline->sinceAlert < EDGE_NEVER) {
    pipeline->sinceAlert++;
  }
  event->alertRecent = pipeline->sinceAlert < config->alertHold;
}

static bool isArmed(edgePipeline_t *pipeline) {
  const float *pwm = pipeline->held + HELD_PWM;
  if (0.25f * (pwm[0] + pwm[1] + pwm[2] + pwm[3]) > pipeline->config.armPwm) {
    pipeline->airborneSteps += pipeline->airborneSteps < EDGE_NEVER ? 1u : 0u;
  } else {
    pipeline->airborneSteps = 0;
  }
  return pipeline->airborneSteps >= pipeline->config.armSamples;
}

/** Hysteresis from probability to edges; EDGE_NONE, EDGE_ENTRY or EDGE_EXIT. */
static uint8_t decode(edgePipeline_t *pipeline, float probability, bool armed) {
  const edgePipelineConfig_t *config = &pipeline->config;
  if (!armed) {
    pipeline->over = false;
    pipeline->sinceEdge = EDGE_NEVER;
    return EDGE_NONE;
  }
  pipeline->sinceEdge += pipeline->sinceEdge < EDGE_NEVER ? 1u : 0u;
  if (!isfinite(probability) || pipeline->sinceEdge < config->dwellSamples) {
    return EDGE_NONE;
  }
  if (!(pipeline->over ? probability <= config->probabilityExit : probability >= config->probabilityEntry)) {
    return EDGE_NONE;
  }
  pipeline->over = !pipeline->over;
  pipeline->sinceEdge = 0;
  return pipeline->over ? EDGE_ENTRY : EDGE_EXIT;
}

bool edgePipelineStep(edgePipeline_t *pipeline, const edgeSample_t *sample, edgeEvent_t *event) {
  takeSample(pipeline, sample);
  event->ready = findFeatures(pipeline);
  memcpy(event->bandPower, pipeline->bandPower, sizeof(event->bandPower));
  memcpy(event->features, pipeline->features, sizeof(event->features));
  findForce(pipeline, event);
  event->armed = isArmed(pipeline);
  event->nonFinite = pipeline->nonFinite;
  event->edge = decode(pipeline, sample->probability, event->armed);
  event->filtered = event->edge != EDGE_NONE && pipeline->config.physicalFilter && !event->alertRecent;
  if (event->filtered) {
    event->edge = EDGE_NONE;
  }
  return event->edge != EDGE_NONE;
}
