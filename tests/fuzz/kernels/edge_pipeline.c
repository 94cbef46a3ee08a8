// edge_pipeline.h: any settings and samples. Two pipelines that begin in other rubbish say the same; events are in
// range; and two windows after the last odd sample the band powers are those of a pipeline that never saw one.
#include "edge_pipeline.h"

#include "fuzz.h"

// Samples of an input before the quiet ones, at most: the shipped window is full in all, the longest one in a quarter.
#define FEW_SAMPLES 150
#define MANY_SAMPLES 400

static const airtouchVehicle_t shipped = {0.0362f, 9.81f, {5.485e-4f, 1.0326e-6f, 2.1303e-11f}, 4.0f};

static edgePipelineConfig_t takeConfig(bytes_t *bytes, uint8_t kind) {
  edgePipelineConfig_t config;
  edgePipelineDefaults(&config, &shipped);
  if (kind & 1) {
    config.window = (uint16_t)(takeByte(bytes) % 210);
    config.hop = (uint16_t)(takeByte(bytes) % 5);
    config.lowHz = takeFloat(bytes, 6.0f);
    config.highHz = takeFloat(bytes, 8.0f);
    config.pFa = takeFloat(bytes, 0.1f);
    config.leadingWindow = (uint16_t)(takeByte(bytes) % 60);
    config.guardCells = (uint16_t)(takeByte(bytes) % 20);
    config.forceMeanSamples = takeFloat(bytes, 50.0f);
  }
  if (kind & 2) {
    config.armPwm = takeFloat(bytes, 2e4f);
    config.probabilityEntry = takeFloat(bytes, 0.3f);
    config.probabilityExit = takeFloat(bytes, 0.3f);
    config.alertHold = (uint16_t)takeWord(bytes);
    config.armSamples = takeByte(bytes);
    config.dwellSamples = takeByte(bytes);
    config.cfarNorm = takeByte(bytes) & 1;
    config.physicalFilter = takeByte(bytes) & 1;
    config.vehicle.nominalVoltage = takeByte(bytes) & 1 ? 4.0f : 0.0f;
  }
  return config;
}

static void quiet(edgeSample_t *sample, uint32_t *seed) {
  *sample = (edgeSample_t){.acc = {0, 0, 9.81f}, .vbat = 3.9f, .thrustAxis = {0, 0, 1}, .probability = NAN};
  for (int i = 0; i < 3; i++) {
    sample->acc[i] += noise(seed);
    sample->gyro[i] = noise(seed);
  }
  for (int i = 0; i < 4; i++) {
    sample->pwm[i] = 4e4f + 3e3f * noise(seed);
  }
}

static void odd(bytes_t *bytes, edgeSample_t *sample, uint32_t *seed) {
  quiet(sample, seed);
  float *const value[16] = {
      sample->acc,         sample->acc + 1,    sample->acc + 2,        sample->gyro,           sample->gyro + 1,
      sample->gyro + 2,    sample->pwm,        sample->pwm + 1,        sample->pwm + 2,        sample->pwm + 3,
      &sample->vbat,       sample->thrustAxis, sample->thrustAxis + 1, sample->thrustAxis + 2, &sample->probability,
      &sample->probability};
  for (uint8_t i = takeByte(bytes) % 32; i < 16; i = (uint8_t)(i + 1 + takeByte(bytes) % 16)) {
    *value[i] = takeFloat(bytes, i < 6 ? 10.0f : (i < 10 ? 3e4f : 0.5f));
  }
}

static uint32_t notFinite(const edgeSample_t *sample) {
  uint32_t count = 0;
  for (int i = 0; i < 10; i++) {
    count += !isfinite(i < 3 ? sample->acc[i] : (i < 6 ? sample->gyro[i - 3] : sample->pwm[i - 6]));
  }
  return count;
}

static bool sameFloat(float a, float b) { return a == b || (isnan(a) && isnan(b)); }

static void checkEvent(const edgePipelineConfig_t *config, const edgeEvent_t *event, bool reported) {
  CHECK(reported == (event->edge != EDGE_NONE) && event->edge <= EDGE_EXIT, "an edge is none, entry or exit");
  CHECK(event->ready <= 1 && event->alert <= 1 && event->alertRecent <= 1 && event->filtered <= 1 && event->armed <= 1,
        "flags are flags");
  CHECK(isfinite(event->forceNorm) && isfinite(event->cfarPower) && event->cfarPower >= 0.0f, "the force is a number");
  CHECK(!isinf(event->threshold) && (!event->alert || event->cfarPower > event->threshold || event->threshold < 1e30f),
        "an alert has a threshold");
  CHECK(event->edge == EDGE_NONE || event->armed, "no edge before the drone is armed");
  CHECK(event->edge == EDGE_NONE || !config->physicalFilter || event->alertRecent, "an edge has its alert");
  for (int i = 0; i < EDGE_PIPELINE_CHANNELS; i++) {
    CHECK(isnan(event->bandPower[i]) || (isfinite(event->bandPower[i]) && event->bandPower[i] >= 0.0f),
          "a power is a number");
  }
  for (int i = 0; i < EDGE_PIPELINE_SENSORS; i++) {
    CHECK(isnan(event->features[i]) == isnan(event->bandPower[3 * i]) && !isinf(event->features[i]),
          "a feature is a number");
  }
}

static void stepBoth(edgePipeline_t *const pipeline[2], const edgeSample_t *sample) {
  edgeEvent_t event[2];
  memset(event, 0x5a, sizeof event);
  memset(&event[1], 0xa5, sizeof event[1]);
  const uint32_t before = pipeline[0]->nonFinite;
  const bool reported = edgePipelineStep(pipeline[0], sample, &event[0]);
  CHECK(edgePipelineStep(pipeline[1], sample, &event[1]) == reported && event[0].alert == event[1].alert &&
            event[0].edge == event[1].edge && sameFloat(event[0].threshold, event[1].threshold) &&
            sameFloat(event[0].features[0], event[1].features[0]),
        "what a pipeline says follows from its settings and samples alone");
  CHECK(event[0].nonFinite - before == notFinite(sample), "values that are not finite are counted");
  checkEvent(&pipeline[0]->config, &event[0], reported);
}

/** Quiet samples for two windows: the past is over, and the band powers are those of a new pipeline. */
static void forget(edgePipeline_t *pipeline, const edgePipelineConfig_t *config, uint32_t *seed) {
  edgePipeline_t *fresh = rubbish(sizeof *fresh, 0);
  edgePipelineInit(fresh, config);
  edgeEvent_t old = {.ready = 0}, new = {.ready = 0};
  bool compared = false;
  for (int i = 0; i < 2 * config->window + 32; i++) {
    edgeSample_t sample;
    quiet(&sample, seed);
    edgePipelineStep(pipeline, &sample, &old);
    edgePipelineStep(fresh, &sample, &new);
    compared = compared || (old.ready && new.ready);
  }
  for (int c = 0; c < EDGE_PIPELINE_CHANNELS && config->hop == 1; c++) {
    const double swing = c < 6 ? 2.0 : 12e3, slip = 16.0 * FLT_EPSILON * sqrt(config->window) * swing;
    CHECK(fabs((double)old.bandPower[c] - new.bandPower[c]) <= 60.0 * (sqrt(new.bandPower[c]) * slip + slip * slip),
          "two windows later nothing is left of what was");
  }
  CHECK(compared || config->hop > 1, "powers come");
  free(fresh);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t kind = takeByte(&bytes);
  const edgePipelineConfig_t config = takeConfig(&bytes, kind);
  edgePipeline_t *pipeline[2] = {rubbish(sizeof **pipeline, 0xff), rubbish(sizeof **pipeline, 0)};
  const bool ready = edgePipelineInit(pipeline[0], &config);
  CHECK(edgePipelineInit(pipeline[1], &config) == ready && (ready || kind & 1),
        "settings are accepted where they are right");
  uint32_t seed = kind;
  const int most = oneIn(4, data, size) ? MANY_SAMPLES : FEW_SAMPLES;
  for (int count = 0; ready && (count == 0 || (count < most && bytes.left > 0));) {
    const uint8_t what = takeByte(&bytes);
    for (int run = what & 1 ? 0 : what / 2; run >= 0; run--, count++) {
      edgeSample_t sample;
      if (what & 1) {
        odd(&bytes, &sample, &seed);
      } else {
        quiet(&sample, &seed);
        sample.probability = 0.5f + 0.5f * noise(&seed);
      }
      stepBoth(pipeline, &sample);
    }
  }
  if (ready && kind & 4 && oneIn(3, data, size)) {
    forget(pipeline[0], &config, &seed);
  }
  free(pipeline[0]);
  free(pipeline[1]);
  return 0;
}
