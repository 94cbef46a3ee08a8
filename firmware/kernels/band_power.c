#include "band_power.h"

#include <math.h>
#include <string.h>

#include "sample_guard.h"

#define BIN_TOLERANCE 1e-3f
#define HALF_PI 1.57079632679489662f
#define MAX_WINDOW 16384

uint16_t bandPowerBins(float sampleRateHz, uint16_t window, float lowHz, float highHz, uint16_t *firstBin) {
  if (!(sampleRateHz > 0.0f) || !isfinite(sampleRateHz)) {
    return 0;
  }
  const float low = ceilf(lowHz * (float)window / sampleRateHz - BIN_TOLERANCE);
  const float high = floorf(highHz * (float)window / sampleRateHz + BIN_TOLERANCE);
  if (!(low >= 1.0f) || !(high <= (float)(window / 2)) || !(low <= high)) {
    return 0;
  }
  if (firstBin != NULL) {
    *firstBin = (uint16_t)((uint16_t)low - 1);
  }
  return (uint16_t)((uint16_t)high - (uint16_t)low + 3);
}

/** cos and sin of 2 pi i / n; the angle is reduced in integers, so that it stays exact to the last bits. */
static void twiddle(uint32_t i, uint32_t n, float *cosine, float *sine) {
  const uint32_t quadrant = 4 * i / n;
  const uint32_t rest = 4 * i - quadrant * n;
  const bool swap = 2 * rest > n;
  const float angle = HALF_PI * (float)(swap ? n - rest : rest) / (float)n;
  const float c = swap ? sinf(angle) : cosf(angle);
  const float s = swap ? cosf(angle) : sinf(angle);
  const bool odd = (quadrant & 1u) != 0;
  const float x = odd ? s : c;
  const float y = odd ? c : s;
  *cosine = (quadrant == 1 || quadrant == 2) ? -x : x;
  *sine = quadrant >= 2 ? -y : y;
}

bool bandPowerInit(bandPower_t *self, float sampleRateHz, uint16_t window, float lowHz, float highHz,
                   uint16_t hop, uint16_t channels, float *storage, size_t floats) {
  memset(self, 0, sizeof(*self));
  if (window < 4 || window > MAX_WINDOW || hop == 0 || channels == 0) {
    return false;
  }
  const uint16_t bins = bandPowerBins(sampleRateHz, window, lowHz, highHz, &self->firstBin);
  if (bins == 0 || floats < BAND_POWER_FLOATS((size_t)window, (size_t)channels, (size_t)bins)) {
    return false;
  }
  self->window = window;
  self->channels = channels;
  self->bins = bins;
  self->hop = hop;
  self->nyquist = 2u * (self->firstBin + bins - 2u) == window;
  self->gain = 1.0f / (1.73205080756887729f * (float)window);
  const size_t sums = (size_t)bins * channels;
  self->whole = (bandSum_t *)storage;
  self->fresh = self->whole + sums;
  self->cosine = storage + 8 * sums;
  self->sine = self->cosine + window;
  self->rotation = self->sine + window;
  self->held = self->rotation + 2 * (size_t)bins;
  self->reference = self->held + channels;
  self->change = self->reference + channels;
  self->level = self->change + channels;
  self->ring = self->level + channels;
  for (uint32_t i = 0; i < window; i++) {
    twiddle(i, window, &self->cosine[i], &self->sine[i]);
  }
  bandPowerReset(self);
  return true;
}

void bandPowerReset(bandPower_t *self) {
  const size_t sums = (size_t)self->bins * self->channels;
  memset(self->whole, 0, sums * sizeof(bandSum_t));
  memset(self->fresh, 0, sums * sizeof(bandSum_t));
  memset(self->ring, 0, (size_t)self->window * self->channels * sizeof(float));
  memset(self->held, 0, self->channels * sizeof(float));
  self->position = 0;
  self->phase = 0;
  self->wait = 0;
  self->full = false;
}

static inline uint16_t wrap(uint32_t phase, uint16_t window) {
  return (uint16_t)(phase >= window ? phase - window : phase);
}

static void takeSample(bandPower_t *self, const float *sample) {
  float *slot = self->ring + (size_t)self->position * self->channels;
  for (uint16_t c = 0; c < self->channels; c++) {
    const float x = guardSample(sample[c], &self->held[c]);
    if (self->position == 0) {
      self->reference[c] = x;
    }
    self->change[c] = x - slot[c];
    self->level[c] = x - self->reference[c];
    slot[c] = x;
  }
}

static void updateSums(bandPower_t *self) {
  const float *change = self->change;
  const float *level = self->level;
  bandSum_t *whole = self->whole;
  bandSum_t *fresh = self->fresh;
  uint16_t phase = self->phase;
  for (uint16_t b = 0; b < self->bins; b++) {
    const float cosine = self->cosine[phase];
    const float sine = self->sine[phase];
    for (uint16_t c = 0; c < self->channels; c++, whole++, fresh++) {
      addCompensated(&whole->re, &whole->reLow, change[c] * cosine);
      addCompensated(&whole->im, &whole->imLow, change[c] * sine);
      addCompensated(&fresh->re, &fresh->reLow, level[c] * cosine);
      addCompensated(&fresh->im, &fresh->imLow, level[c] * sine);
    }
    phase = wrap((uint32_t)phase + self->position, self->window);
  }
}

static void advance(bandPower_t *self) {
  self->phase = wrap((uint32_t)self->phase + self->firstBin, self->window);
  self->position++;
  if (self->position == self->window) {
    bandSum_t *done = self->fresh;
    self->fresh = self->whole;
    self->whole = done;
    memset(self->fresh, 0, (size_t)self->bins * self->channels * sizeof(bandSum_t));
    self->position = 0;
    self->full = true;
  }
}

/** The twiddles of the oldest sample in the window, which turn each bin's phase to start there. */
static void findRotations(bandPower_t *self) {
  uint16_t phase = self->phase;
  for (uint16_t b = 0; b < self->bins; b++) {
    self->rotation[2 * b] = self->cosine[phase];
    self->rotation[2 * b + 1] = self->sine[phase];
    phase = wrap((uint32_t)phase + self->position, self->window);
  }
  if (self->firstBin == 0) {  // the window's mean is not part of the power
    self->rotation[0] = 0.0f;
    self->rotation[1] = 0.0f;
  }
}

static float channelPower(const bandPower_t *self, uint16_t channel) {
  const bandSum_t *sum = self->whole + channel;
  const float *rotation = self->rotation;
  float re0 = 0.0f, im0 = 0.0f, re1 = 0.0f, im1 = 0.0f;  // the two bins before this one
  float power = 0.0f, last = 0.0f;
  for (uint16_t b = 0; b < self->bins; b++, sum += self->channels, rotation += 2) {
    const float re2 = sum->re * rotation[0] + sum->im * rotation[1];
    const float im2 = sum->im * rotation[0] - sum->re * rotation[1];
    if (b >= 2) {
      const float re = ((re1 - re0) + (re1 - re2)) * self->gain;
      const float im = ((im1 - im0) + (im1 - im2)) * self->gain;
      last = re * re + im * im;
      power += last;
    }
    re0 = re1;
    im0 = im1;
    re1 = re2;
    im1 = im2;
  }
  return self->nyquist ? power - 0.5f * last : power;
}

bool bandPowerStep(bandPower_t *self, const float *sample, float *power) {
  takeSample(self, sample);
  updateSums(self);
  advance(self);
  if (!self->full) {
    return false;
  }
  if (self->wait > 0) {
    self->wait--;
    return false;
  }
  self->wait = (uint16_t)(self->hop - 1);
  findRotations(self);
  for (uint16_t c = 0; c < self->channels; c++) {
    power[c] = channelPower(self, c);
  }
  return true;
}
