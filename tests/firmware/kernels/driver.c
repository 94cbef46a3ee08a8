// Feeds files of arbitrary bytes through every kernel; built with sanitizers by test_build.py.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "airtouch_stream.h"
#include "cross_spectrum.h"
#include "disturbance_force.h"
#include "edge_pipeline.h"
#include "stream_detector.h"

#define MAX_BYTES (1 << 20)

typedef struct {
  const unsigned char *at;
  size_t left;
} bytes_t;

/** The next bytes, zeros past the end. */
static void take(bytes_t *bytes, void *to, size_t count) {
  const size_t have = count < bytes->left ? count : bytes->left;
  memset(to, 0, count);
  memcpy(to, bytes->at, have);
  bytes->at += have;
  bytes->left -= have;
}

static uint16_t takeUint(bytes_t *bytes, uint16_t limit) {
  uint16_t x;
  take(bytes, &x, sizeof(x));
  return (uint16_t)(x % limit);
}

static float takeFloat(bytes_t *bytes) {
  float x;
  take(bytes, &x, sizeof(x));
  return x;
}

static void check(bool good, const char *what) {
  if (!good) {
    fprintf(stderr, "broken promise: %s\n", what);
    abort();
  }
}

/** Exactly as much memory as was asked for, so that a byte too far is seen. */
static float *floats(size_t count) {
  float *memory = malloc(count * sizeof(float) + 1);
  check(memory != NULL, "memory");
  return memory;
}

static void feedBandPower(bytes_t bytes, bool wild) {
  const uint16_t window = (uint16_t)(takeUint(&bytes, 300) + 1), channels = (uint16_t)(takeUint(&bytes, 5) + 1);
  const uint16_t hop = (uint16_t)(takeUint(&bytes, 9) + 1);
  const float wildRate = takeFloat(&bytes), wildLow = takeFloat(&bytes), wildHigh = takeFloat(&bytes);
  const float rate = wild ? wildRate : 100.0f, low = wild ? wildLow : (float)takeUint(&bytes, 40);
  const float high = wild ? wildHigh : low + 12.0f;
  const size_t bins = bandPowerBins(rate, window, low, high, NULL);
  const size_t need = BAND_POWER_FLOATS((size_t)window, (size_t)channels, bins);
  bandPower_t bank;
  float *storage = floats(need);
  check(!bandPowerInit(&bank, rate, window, low, high, hop, channels, storage, need - 1), "too little storage");
  if (bandPowerInit(&bank, rate, window, low, high, hop, channels, storage, need)) {
    float sample[5], power[5];
    while (bytes.left > 0) {
      for (uint16_t c = 0; c < channels; c++) {
        sample[c] = takeFloat(&bytes);
      }
      if (bandPowerStep(&bank, sample, power)) {
        for (uint16_t c = 0; c < channels; c++) {
          check(isfinite(power[c]) && power[c] >= 0.0f, "a band power is finite and not negative");
        }
      }
    }
    bandPowerReset(&bank);
  }
  free(storage);
}

static void feedCfar(bytes_t bytes) {
  const uint16_t leading = takeUint(&bytes, 60), guard = takeUint(&bytes, 20);
  const float wild = takeFloat(&bytes);
  const float pFa = takeUint(&bytes, 2) ? wild : 1e-6f;
  frCfar_t cfar;
  float *storage = floats(FR_CFAR_FLOATS((size_t)leading, (size_t)guard));
  if (frCfarInit(&cfar, leading, guard, pFa, storage, FR_CFAR_FLOATS((size_t)leading, (size_t)guard))) {
    for (uint32_t i = 0; bytes.left > 0; i++) {
      float threshold;
      const bool alert = frCfarStep(&cfar, takeFloat(&bytes), &threshold);
      check(isnan(threshold) == (i < (uint32_t)leading + guard), "a threshold once the leading window is full");
      check(!alert || !isnan(threshold), "no alert without a threshold");
    }
  }
  free(storage);
}

static void feedFeatures(bytes_t bytes) {
  const uint16_t window = takeUint(&bytes, 120), columns = takeUint(&bytes, 4);
  const uint16_t groups[3] = {(uint16_t)(takeUint(&bytes, 4) + 1), (uint16_t)(takeUint(&bytes, 4) + 1), 1};
  streamingZScore_t streaming;
  streamingZScoreInit(&streaming, takeUint(&bytes, 2) ? 50.0f : 1e-40f);
  float *values = floats((size_t)window * columns);
  while (bytes.left > 0) {
    float power[9], feature[3];
    take(&bytes, power, sizeof(power));
    cascadedCrossSpectrum(power, groups, 3, feature);
    for (int i = 0; i < 3; i++) {
      check(isnan(feature[i]) || (isfinite(feature[i]) && feature[i] >= 0.0f), "a feature is finite");
    }
    check(isfinite(streamingZScoreStep(&streaming, power[0])), "a streaming z-score is finite");
    take(&bytes, values, (size_t)window * columns * sizeof(float));
    zScoreWindow(values, window, columns, values);
    for (size_t i = 0; i < (size_t)window * columns; i++) {
      check(isfinite(values[i]), "a z-score is finite");
    }
  }
  free(values);
}

static void change(bytes_t *bytes, edgePipeline_t *pipeline) {
  float to[3];
  take(bytes, to, sizeof(to));
  const edgePipelineConfig_t before = pipeline->config;
  if (!edgePipelineSetBand(pipeline, to[0], to[1])) {
    check(memcmp(&before.lowHz, &pipeline->config.lowHz, sizeof(float)) == 0 &&
              memcmp(&before.highHz, &pipeline->config.highHz, sizeof(float)) == 0,
          "a band that is refused changes nothing");
  }
  if (!edgePipelineSetFalseAlarm(pipeline, to[2])) {
    check(memcmp(&before.pFa, &pipeline->config.pFa, sizeof(float)) == 0, "nor does a false-alarm probability");
  }
}

static void feedPipeline(bytes_t bytes, bool wild) {
  const airtouchVehicle_t vehicle = {0.0362f, 9.81f, {5.485e-4f, 1.0326e-6f, 2.1303e-11f}, 4.0f};
  edgePipelineConfig_t config;
  edgePipelineDefaults(&config, &vehicle);
  if (wild) {
    edgePipelineConfig_t any;
    take(&bytes, &any, sizeof(any));
    config.probabilityEntry = any.probabilityEntry;
    config.forceMeanSamples = any.forceMeanSamples;
    config.armPwm = any.armPwm;
    config.vehicle = any.vehicle;
    config.window = (uint16_t)(any.window % 250);
    config.hop = (uint16_t)(any.hop % 10);
    config.leadingWindow = (uint16_t)(any.leadingWindow % 60);
    config.guardCells = (uint16_t)(any.guardCells % 20);
    config.alertHold = any.alertHold;
    config.armSamples = any.armSamples;
    config.cfarNorm = any.cfarNorm;
  }
  edgePipeline_t *pipeline = malloc(sizeof(*pipeline));
  check(pipeline != NULL, "memory");
  const bool ready = edgePipelineInit(pipeline, &config);
  check(ready || wild, "the defaults are accepted");
  uint32_t seen = 0;
  while (ready && bytes.left > 0) {
    edgeSample_t sample;
    edgeEvent_t event;
    take(&bytes, &sample, sizeof(sample));
    if (wild && seen++ % 8 == 7) {
      change(&bytes, pipeline);
    }
    const bool edge = edgePipelineStep(pipeline, &sample, &event);
    check(edge == (event.edge != EDGE_NONE) && event.edge <= EDGE_EXIT, "an edge is none, entry or exit");
    if (!wild) {
      seen++;
      check(isfinite(event.forceNorm) && isfinite(event.cfarPower), "the force is finite");
      check(isfinite(event.features[2]) == (seen >= AIRTOUCH_BAND_WINDOW), "features once the window is full");
    }
  }
  free(pipeline);
}

/** The shipped network; wild: with any decoder settings and logits. */
static void feedStreamDetector(bytes_t bytes, bool wild) {
  int8_t *arena = malloc(AIRTOUCH_STREAM_ARENA_BYTES);
  check(arena != NULL, "memory");
  decoderConfig_t settings = airtouchStreamDecoder;
  if (wild) {
    take(&bytes, &settings, sizeof(settings));
  }
  streamDetector_t detector;
  check(streamDetectorInit(&detector, &airtouchStreamMotion, &airtouchStream, &airtouchStreamQuantisation, &settings,
                           arena),
        "the shipped network is accepted");
  while (bytes.left > 0) {
    float sample[10];
    streamEvent_t event;
    take(&bytes, sample, sizeof(sample));
    const bool edge = streamDetectorStep(&detector, sample, sample + 3, sample + 6, &event);
    check(edge == (event.edge != EDGE_NONE) && event.edge <= EDGE_EXIT, "an edge is none, entry or exit");
    check(isfinite(event.logits[0]) && isfinite(event.logits[2]), "logits are finite");
    if (wild) {
      check(edgeDecoderStep(&detector.decoder, sample, sample[9] > 0.0f) <= EDGE_EXIT, "any logits are taken");
    }
  }
  free(arena);
}

int main(int argc, char **argv) {
  static unsigned char buffer[MAX_BYTES];
  for (int i = 1; i < argc; i++) {
    FILE *file = fopen(argv[i], "rb");
    check(file != NULL, argv[i]);
    const bytes_t bytes = {buffer, fread(buffer, 1, sizeof(buffer), file)};
    fclose(file);
    for (int wild = 0; wild < 2; wild++) {
      feedBandPower(bytes, wild);
      feedPipeline(bytes, wild);
      feedStreamDetector(bytes, wild);
    }
    feedCfar(bytes);
    feedFeatures(bytes);
  }
  printf("%d files\n", argc - 1);
  return 0;
}
