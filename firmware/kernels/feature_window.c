#include "feature_window.h"

#include <math.h>
#include <string.h>

#include "sample_guard.h"
#include "start_up_math.h"

/** Beyond so many time constants e^-t is less than half a unit in the last place of 1. */
#define SETTLED 20.0f
#define LONGEST_SETTLE 4e9f  // samples: more than a year at 100 Hz

static float compensatedMean(const float *x, uint16_t count, uint16_t stride) {
  float sum = 0.0f, low = 0.0f;
  for (uint16_t i = 0; i < count; i++) {
    addCompensated(&sum, &low, x[(uint32_t)i * stride]);
  }
  return (sum - low) / (float)count;
}

static void zScoreColumn(const float *x, uint16_t window, uint16_t columns, float *out) {
  float held = 0.0f, first = 0.0f, span = 0.0f;
  for (uint16_t i = 0; i < window; i++) {
    const uint32_t at = (uint32_t)i * columns;
    const float value = guardSample(x[at], &held);
    first = i == 0 ? value : first;
    out[at] = value - first;
    span = fmaxf(span, fabsf(out[at]));
  }
  if (!(span > 0.0f)) {
    return;  // constant: out is all zeros
  }
  for (uint16_t i = 0; i < window; i++) {
    out[(uint32_t)i * columns] /= span;
  }
  const float mean = compensatedMean(out, window, columns);
  float sum = 0.0f, low = 0.0f;
  for (uint16_t i = 0; i < window; i++) {
    const float d = out[(uint32_t)i * columns] - mean;
    addCompensated(&sum, &low, d * d);
  }
  const float std = sqrtf(sum / (float)window);
  for (uint16_t i = 0; i < window; i++) {
    out[(uint32_t)i * columns] = (out[(uint32_t)i * columns] - mean) / std;
  }
}

void zScoreWindow(const float *features, uint16_t window, uint16_t columns, float *out) {
  for (uint16_t c = 0; c < columns; c++) {
    zScoreColumn(features + c, window, columns, out + c);
  }
}

void exponentialMeanInit(exponentialMean_t *self, float timeConstant) {
  memset(self, 0, sizeof(*self));
  self->rate = -exponentialLessOne(-1.0f / timeConstant);
  const float settle = SETTLED * timeConstant;
  self->settle = settle < LONGEST_SETTLE ? (uint32_t)settle + 1u : (uint32_t)LONGEST_SETTLE;
}

float exponentialMeanStep(exponentialMean_t *self, float x) {
  if (self->weight <= 0.0f) {
    self->mean = x;  // the first sample
  }
  if (self->settle > 0) {
    self->settle--;
    addCompensated(&self->weight, &self->weightLow, 1.0f - self->rate * self->weight);
    self->gain = self->settle > 0 ? 1.0f / self->weight : self->rate;
  }
  const float deviation = (x - self->mean) + self->low;
  addCompensated(&self->mean, &self->low, self->gain * deviation);
  return deviation;
}

void streamingZScoreInit(streamingZScore_t *self, float timeConstant) {
  memset(self, 0, sizeof(*self));
  exponentialMeanInit(&self->mean, timeConstant);
}

float streamingZScoreStep(streamingZScore_t *self, float x) {
  if (!self->started && !isfinite(x)) {
    return 0.0f;
  }
  const float value = guardSample(x, &self->held);
  self->started = true;
  const float step = exponentialMeanStep(&self->mean, value);
  const float gain = self->mean.gain;
  self->variance = (1.0f - gain) * (self->variance + gain * step * step);
  const float std = sqrtf(self->variance);
  if (!(std >= STREAMING_STD_FLOOR)) {
    return 0.0f;
  }
  return ((value - self->mean.mean) + self->mean.low) / std;
}
