// The paper's pipeline and network, in C: the program of host/docs/port.md, which its test builds and runs.
// In: rows of ten floats (acceleration m/s^2, level, with gravity; rates rad/s; PWM). Out: features, P(over), edge.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "airtouch_model.h"
#include "airtouch_stream.h"  // for the vehicle alone
#include "edge_pipeline.h"

enum { ROWS = AIRTOUCH_MODEL_ROWS, VALUES = ROWS * AIRTOUCH_MODEL_COLUMNS };

int main(void) {
  static edgePipeline_t pipeline;
  edgePipelineConfig_t config;
  edgePipelineDefaults(&config, &airtouchStreamMotion.vehicle);
  config.probabilityEntry = AIRTOUCH_MODEL_PROBABILITY_ENTRY;  // as chosen with the network
  config.probabilityExit = AIRTOUCH_MODEL_PROBABILITY_EXIT;
  config.dwellSamples = AIRTOUCH_MODEL_DWELL_SAMPLES;
  config.alertHold = AIRTOUCH_MODEL_ALERT_HOLD;
  if (networkInt8Check(&airtouchNetwork) >= 0 || !edgePipelineInit(&pipeline, &config)) {
    return 1;
  }
  static float features[VALUES], window[VALUES];
  static _Alignas(4) int8_t input[VALUES], arena[AIRTOUCH_MODEL_ARENA_BYTES];
  edgeSample_t sample = {.vbat = NAN, .thrustAxis = {NAN, NAN, NAN}, .probability = NAN};
  float row[10];
  for (int i = 0, full = 0; fread(row, sizeof row, 1, stdin) == 1; i++) {
    memcpy(sample.acc, row, sizeof sample.acc);
    memcpy(sample.gyro, row + 3, sizeof sample.gyro);
    memcpy(sample.pwm, row + 6, sizeof sample.pwm);
    edgeEvent_t event;
    edgePipelineStep(&pipeline, &sample, &event);
    if (event.ready) {  // the newest features last
      memmove(features, features + AIRTOUCH_MODEL_COLUMNS, sizeof features - sizeof event.features);
      memcpy(features + VALUES - AIRTOUCH_MODEL_COLUMNS, event.features, sizeof event.features);
      full++;
    }
    if (full >= ROWS) {
      zScoreWindow(features, ROWS, AIRTOUCH_MODEL_COLUMNS, window);
      networkInt8Quantise(&airtouchNetwork, window, VALUES, input);
      const int8_t *q = networkInt8Run(&airtouchNetwork, input, arena);
      sample.probability = 1.0f / (1.0f + expf(AIRTOUCH_MODEL_OUTPUT_SCALE * (float)(q[0] - q[1])));  // for the next
    }
    printf("%d %g %g %g %g %d\n", i, (double)event.features[0], (double)event.features[1], (double)event.features[2],
           (double)sample.probability, event.edge);
  }
  return 0;
}
