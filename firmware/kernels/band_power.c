#include "band_power.h"

#include <math.h>
#include <string.h>

#include "sample_guard.h"
#include "start_up_math.h"

#define BIN_TOLERANCE 1e-3f
#define HALF_PI 1.57079632679489662f
#define MAX_WINDOW 16384
#define RECENT_SAMPLES 16u  // in which the latest sums are kept apart
#define COMMON_BINS 7       // those of 6 to 8 Hz in 2 s: the loops over them unroll

// Inlined whatever the compiler thinks of it, so that COMMON_BINS is a constant there. With -DAIRTOUCH_PLAIN_C it is
// C11 alone, as gap8/kernels/extensions.h: the same bits, only slower.
#if defined(__GNUC__) && !defined(AIRTOUCH_PLAIN_C)
#define INLINED static inline __attribute__((always_inline))
#define UNROLLED _Pragma("GCC unroll 7")
#else
#define INLINED static inline
#define UNROLLED
#endif

uint16_t bandPowerBins(float sampleRateHz, uint16_t window, float lowHz, float highHz, uint16_t *firstBin) {
  if (!(sampleRateHz > 0.0f) || !isfinite(sampleRateHz)) {
    return 0;
  }
  const float low = ceilf(lowHz * (float)window / sampleRateHz - BIN_TOLERANCE);
  const float high = floorf(highHz * (float)window / sampleRateHz + BIN_TOLERANCE);
  if (!(low >= 1.0f) || !(high <= (float)(uint16_t)(window / 2)) || !(low <= high)) {
    return 0;
  }
  if (firstBin != NULL) {
    *firstBin = (uint16_t)((uint16_t)low - 1);
  }
  return (uint16_t)((uint16_t)high - (uint16_t)low + 3);
}

/** cos and sin of 2 pi i / n; the angle is reduced in integers, so that it stays exact to the last bits. */
static void twiddleFactor(uint32_t i, uint32_t n, float *cosine, float *sine) {
  const uint32_t quadrant = 4 * i / n;
  const uint32_t rest = 4 * i - quadrant * n;
  const bool swap = 2 * rest > n;
  const float angle = HALF_PI * (float)(swap ? n - rest : rest) / (float)n;
  float c, s;
  if (swap) {
    sineCosine(angle, &c, &s);
  } else {
    sineCosine(angle, &s, &c);
  }
  const bool odd = (quadrant & 1u) != 0;
  const float x = odd ? s : c;
  const float y = odd ? c : s;
  *cosine = (quadrant == 1 || quadrant == 2) ? -x : x;
  *sine = quadrant >= 2 ? -y : y;
}

static inline uint16_t wrap(uint32_t phase, uint16_t window) {
  return (uint16_t)(phase >= window ? phase - window : phase);
}

/** The twiddles of the next sample, and so of the oldest one in the window: bins are read relative to it. */
static void findTwiddles(bandPower_t *self) {
  uint16_t phase = self->phase;
  float *twiddle = self->twiddle;
  for (uint16_t b = 0; b < self->bins; b++, twiddle += 2) {
    twiddle[0] = self->cosine[phase];
    twiddle[1] = self->sine[phase];
    phase = wrap((uint32_t)phase + self->position, self->window);
  }
  if (self->firstBin == 0) {  // the window's mean is not part of the power
    self->twiddle[0] = 0.0f;
    self->twiddle[1] = 0.0f;
  }
}

bool bandPowerInit(bandPower_t *self, float sampleRateHz, uint16_t window, float lowHz, float highHz, uint16_t hop,
                   uint16_t channels, float *storage, size_t floats) {
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
  const size_t sums = (size_t)bins * channels;
  self->sum = (bandSum_t *)storage;
  self->recent = self->sum + sums;
  self->cosine = storage + 8 * sums;
  self->sine = self->cosine + window;
  self->twiddle = self->sine + window;
  self->held = self->twiddle + 2 * (size_t)bins;
  self->reference = self->held + channels;
  self->ring = self->reference + channels;
  self->scale = 1.0f;
  while (self->scale * (float)window > 1.0f) {  // a power of two: scaling by it rounds nothing
    self->scale *= 0.5f;
  }
  const float share = self->scale * (float)window;
  self->gain = 1.0f / (3.0f * share * share);
  for (uint32_t i = 0; i < window; i++) {
    twiddleFactor(i, window, &self->cosine[i], &self->sine[i]);
  }
  bandPowerReset(self);
  return true;
}

void bandPowerReset(bandPower_t *self) {
  const size_t sums = (size_t)self->bins * self->channels;
  memset(self->sum, 0, sums * sizeof(bandSum_t));
  memset(self->recent, 0, sums * sizeof(bandSum_t));
  memset(self->ring, 0, (size_t)self->window * self->channels * sizeof(float));
  memset(self->held, 0, self->channels * sizeof(float));
  self->position = 0;
  self->phase = 0;
  self->wait = 0;
  self->started = false;
  self->full = false;
  findTwiddles(self);
}

/** The latest few samples of a channel join the rest. */
static void keepRecent(bandSum_t *sum, bandSum_t *recent, uint16_t bins) {
  for (uint16_t b = bins; b > 0; b--, sum++, recent++) {
    sum->re += recent->re;
    sum->im += recent->im;
    sum->blockRe += recent->blockRe;
    sum->blockIm += recent->blockIm;
    *recent = (bandSum_t){0.0f, 0.0f, 0.0f, 0.0f};
  }
}

/** The block is as long as the window: its sums are the window's. */
static void endBlock(bandSum_t *sum, uint16_t bins) {
  for (uint16_t b = bins; b > 0; b--, sum++) {
    *sum = (bandSum_t){sum->blockRe, sum->blockIm, 0.0f, 0.0f};
  }
}

/** Adds to the sums of each bin of a channel what has changed in the window and what is new in the block. */
INLINED void addSample(bandSum_t *recent, const float *twiddle, uint16_t bins, float change, float level) {
  UNROLLED
  for (uint16_t b = 0; b < bins; b++) {
    const float cosine = twiddle[2 * b];
    const float sine = twiddle[2 * b + 1];
    recent[b].re += change * cosine;
    recent[b].im += change * sine;
    recent[b].blockRe += level * cosine;
    recent[b].blockIm += level * sine;
  }
}

/** Takes a sample of every channel; `bins` is a constant where it is known, so that loops over it unroll. */
INLINED void takeSample(bandPower_t *self, const float *sample, uint16_t bins) {
  float *slot = self->ring + (size_t)self->position * self->channels;
  bandSum_t *sum = self->sum;
  bandSum_t *recent = self->recent;
  uint16_t age = self->position;  // samples in the channel's block; channels begin theirs one after the other
  for (uint16_t c = 0; c < self->channels; c++, sum += bins, recent += bins) {
    const float x = guardSample(sample[c], &self->held[c]);
    if (!self->started) {
      self->reference[c] = x;  // the past before the first sample is like it, and adds nothing to any bin
    }
    if (age % RECENT_SAMPLES == 0) {
      keepRecent(sum, recent, bins);
    }
    if (age == 0) {
      endBlock(sum, bins);
      age = self->window;
      if (self->full) {
        self->reference[c] = x;
      }
    }
    age--;
    const float level = (x - self->reference[c]) * self->scale;
    const float change = self->full ? (x - slot[c]) * self->scale : level;
    slot[c] = x;
    addSample(recent, self->twiddle, bins, change, level);
  }
  self->started = true;
}

static void advance(bandPower_t *self) {
  self->phase = wrap((uint32_t)self->phase + self->firstBin, self->window);
  self->position++;
  if (self->position == self->window) {
    self->position = 0;
    self->phase = 0;
    self->full = true;
  }
  findTwiddles(self);
}

INLINED float channelPower(const bandSum_t *sum, const bandSum_t *recent, const float *twiddle, uint16_t bins,
                           bool nyquist) {
  float re0 = 0.0f, im0 = 0.0f;            // the bin before this one
  float reSlope0 = 0.0f, imSlope0 = 0.0f;  // and its difference from the one before that
  float power = 0.0f, last = 0.0f;
  UNROLLED
  for (uint16_t b = 0; b < bins; b++) {
    const float cosine = twiddle[2 * b];
    const float sine = twiddle[2 * b + 1];
    const float re = sum[b].re + recent[b].re;
    const float im = sum[b].im + recent[b].im;
    const float re1 = re * cosine + im * sine;
    const float im1 = im * cosine - re * sine;
    const float reSlope1 = re1 - re0;
    const float imSlope1 = im1 - im0;
    if (b >= 2) {
      const float reWindowed = reSlope1 - reSlope0;
      const float imWindowed = imSlope1 - imSlope0;
      last = reWindowed * reWindowed + imWindowed * imWindowed;
      power += last;
    }
    re0 = re1;
    im0 = im1;
    reSlope0 = reSlope1;
    imSlope0 = imSlope1;
  }
  return nyquist ? power - 0.5f * last : power;
}

INLINED void findPowers(const bandPower_t *self, float *power, uint16_t bins) {
  size_t first = 0;
  for (uint16_t c = 0; c < self->channels; c++, first += bins) {
    power[c] = self->gain * channelPower(self->sum + first, self->recent + first, self->twiddle, bins, self->nyquist);
  }
}

bool bandPowerStep(bandPower_t *self, const float *sample, float *power) {
  const bool fixedBins = self->bins == COMMON_BINS;
  if (fixedBins) {
    takeSample(self, sample, COMMON_BINS);
  } else {
    takeSample(self, sample, self->bins);
  }
  advance(self);
  if (!self->full) {
    return false;
  }
  if (self->wait > 0) {
    self->wait--;
    return false;
  }
  self->wait = (uint16_t)(self->hop - 1);
  if (fixedBins) {
    findPowers(self, power, COMMON_BINS);
  } else {
    findPowers(self, power, self->bins);
  }
  return true;
}
