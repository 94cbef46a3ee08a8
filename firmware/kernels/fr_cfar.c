#include "fr_cfar.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "sample_guard.h"
#include "start_up_math.h"

// Of a cell, in its unit: the square of SAMPLE_LIMIT. The sum of MAX_CELLS such cells is still a float.
#define POWER_LIMIT 1e30f
#define MAX_CELLS 32767u

bool frCfarInit(frCfar_t *self, uint16_t leadingWindow, uint16_t guardCells, float pFa, float *storage, size_t floats) {
  memset(self, 0, sizeof(*self));
  const uint32_t lag = (uint32_t)leadingWindow + guardCells;
  if (leadingWindow == 0 || lag > MAX_CELLS || floats < lag) {
    return false;
  }
  self->leadingWindow = leadingWindow;
  self->lag = (uint16_t)lag;
  if (!frCfarSetFalseAlarm(self, pFa)) {
    return false;
  }
  self->ring = storage;
  frCfarReset(self);
  return true;
}

bool frCfarSetFalseAlarm(frCfar_t *self, float pFa) {
  if (!(pFa >= FLT_MIN && pFa < 1.0f)) {
    return false;
  }
  self->factor = exponentialLessOne(-naturalLogarithm(pFa) / (float)self->leadingWindow);
  return true;
}

void frCfarReset(frCfar_t *self) {
  memset(self->ring, 0, self->lag * sizeof(float));
  self->oldest = 0;
  self->count = 0;
  self->held = 0.0f;
}

static float sumRun(const float *cell, uint16_t count, float sum) {
  for (uint16_t i = 0; i < count; i++) {
    sum += cell[i];
  }
  return sum;
}

static float leadingSum(const frCfar_t *self) {
  const uint16_t untilEnd = (uint16_t)(self->lag - self->oldest);
  if (self->leadingWindow <= untilEnd) {
    return sumRun(self->ring + self->oldest, self->leadingWindow, 0.0f);
  }
  const float sum = sumRun(self->ring + self->oldest, untilEnd, 0.0f);
  return sumRun(self->ring, (uint16_t)(self->leadingWindow - untilEnd), sum);
}

bool frCfarStep(frCfar_t *self, float power, float *threshold) {
  if (isfinite(power)) {
    self->held = clampFloat(power, 0.0f, POWER_LIMIT);
  }
  const float cell = self->held;
  const bool ready = self->count == self->lag;
  float limit = NAN;
  if (ready) {
    limit = self->factor * leadingSum(self);
    limit = limit > FLT_MAX ? FLT_MAX : limit;
  } else {
    self->count++;
  }
  self->ring[self->oldest] = cell;
  self->oldest = (uint16_t)(self->oldest + 1u == self->lag ? 0 : self->oldest + 1);
  *threshold = limit;
  return ready && cell > limit;
}
