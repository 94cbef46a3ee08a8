// band_power.h: any settings and samples, held against the sum of its header in double: the Hann window and a plain DFT
// over the last window. The error that float may make is that of a sum over what the last two windows held.
#include "band_power.h"
#include "sample_guard.h"

#include "fuzz.h"

#define SAMPLES 900
#define CHANNELS 3
#define COMPARED 24  // outputs of an input
#define PI 3.14159265358979323846

typedef struct {
  bandPower_t bank;
  double past[SAMPLES][CHANNELS];  // as the guard lets them through
  float held[CHANNELS];
  int count;
  int compared;
} world_t;

static world_t world;
static double cosine[512], sine[512];  // of i / window turns

static void tabulate(int window) {
  for (int i = 0; i < window; i++) {
    cosine[i] = cos(2.0 * PI * i / window);
    sine[i] = sin(2.0 * PI * i / window);
  }
}

/** The power of a channel's last window by the definition. */
static double definition(int channel) {
  const bandPower_t *bank = &world.bank;
  const int n = bank->window;
  double x[512], mean = 0.0, power = 0.0;
  for (int i = 0; i < n; i++) {
    x[i] = world.past[world.count - n + i][channel] - world.past[world.count - n][channel];
    mean += x[i] / n;
  }
  for (int k = bank->firstBin + 1; k < bank->firstBin + bank->bins - 1; k++) {
    double re = 0.0, im = 0.0;
    for (int i = 0; i < n; i++) {
      const double weighted = (0.5 - 0.5 * cosine[i]) * (x[i] - mean);
      re += weighted * cosine[k * i % n];
      im -= weighted * sine[k * i % n];
    }
    power += (re * re + im * im) * (2 * k == n ? 0.5 : 1.0);  // one-sided, but for half the rate
  }
  return power * 2.0 / (n * 3.0 / 8.0 * n);
}

/** How far samples swing in the last two windows and a little: what the sums have held. */
static double swing(int channel) {
  const int span = 2 * world.bank.window + 32;
  const int from = world.count > span ? world.count - span : 0;
  double low = INFINITY, high = -INFINITY;
  for (int i = from; i < world.count; i++) {
    low = fmin(low, world.past[i][channel]);
    high = fmax(high, world.past[i][channel]);
  }
  return high - low;
}

static void checkPower(const float *power) {
  for (int c = 0; c < world.bank.channels; c++) {
    CHECK(isfinite(power[c]) && power[c] >= 0.0f, "a power is a number from 0 up");
    if (world.compared < COMPARED) {
      const double right = definition(c);
      const double slip = 16.0 * FLT_EPSILON * sqrt(world.bank.window) * swing(c);  // of an amplitude
      const double allowed = 6.0 * world.bank.bins * (sqrt(right) * slip + slip * slip) + 1e-37;
      CHECK(fabs(power[c] - right) <= allowed + 1e-5 * right, "a power is that of the definition");
    }
  }
  world.compared++;
}

static void step(const float *sample) {
  float *power = rubbish(world.bank.channels * sizeof *power, 0xff);  // NaN where nothing is written
  float *exact = exactCopy(sample, world.bank.channels * sizeof *sample);
  for (int c = 0; c < world.bank.channels; c++) {
    world.past[world.count][c] = guardSample(sample[c], &world.held[c]);
  }
  world.count++;
  const int after = world.count - world.bank.window;
  const bool due = after >= 0 && after % world.bank.hop == 0;
  CHECK(bandPowerStep(&world.bank, exact, power) == due, "powers come when a window is full, then every hop");
  if (due) {
    checkPower(power);
  }
  free(exact);
  free(power);
}

/** A run of samples: noise on a level, held still, or any values. */
static void feed(bytes_t *bytes) {
  const uint8_t kind = takeByte(bytes);
  const int length = 1 + takeByte(bytes) * (kind & 8 ? 2 : 1);
  const float level = takeFloat(bytes, 10.0f), size = takeFinite(bytes, 1.0f, 1e14f);
  uint32_t seed = kind;
  for (int i = 0; i < length && world.count < SAMPLES; i++) {
    float sample[CHANNELS];
    for (int c = 0; c < CHANNELS; c++) {
      sample[c] = kind & 1 ? takeFloat(bytes, 5.0f) : level + size * noise(&seed);
    }
    step(sample);
  }
}

/** Settings that are mostly right. */
static bool begin(bytes_t *bytes, float *storage, size_t floats, uint16_t window, uint16_t channels) {
  const uint8_t kind = takeByte(bytes);
  float rate = 100.0f, low = 0.0f, high = 0.0f;
  if (kind & 1) {
    rate = takeFloat(bytes, 100.0f);
    low = takeFloat(bytes, 10.0f);
    high = takeFloat(bytes, 10.0f);
  } else {
    const uint32_t first = 1 + takeBelow(bytes, window / 2u + 1u), bins = 1 + takeByte(bytes) % 12u;
    low = (float)first * rate / (float)(window > 0 ? window : 1);
    high = (float)(first + bins - 1) * rate / (float)(window > 0 ? window : 1);
  }
  const uint16_t hop = (uint16_t)(kind / 2 % 8);
  uint16_t firstBin = 0;
  const uint16_t bins = bandPowerBins(rate, window, low, high, &firstBin);
  CHECK(bins == 0 || (bins >= 3 && firstBin + bins - 2 <= window / 2), "a band lies between zero and half the rate");
  const bool right = window >= 4 && window <= 16384 && hop > 0 && channels > 0 && bins > 0 &&
                     floats >= BAND_POWER_FLOATS((size_t)window, (size_t)channels, (size_t)bins);
  const bool ready = bandPowerInit(&world.bank, rate, window, low, high, hop, channels, storage, floats);
  CHECK(ready == right, "settings are accepted where they are right");
  return ready;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint16_t window = (uint16_t)(takeByte(&bytes) < 192 ? takeBelow(&bytes, 64) : takeBelow(&bytes, 300));
  const uint16_t channels = (uint16_t)(takeByte(&bytes) % (CHANNELS + 1));
  const size_t floats = BAND_POWER_FLOATS((size_t)window, (size_t)channels, 3u + takeByte(&bytes) % 12u);
  float *storage = rubbish(floats * sizeof *storage, 0xff);
  memset(&world, 0, sizeof world.bank);
  memset(world.held, 0, sizeof world.held);
  world.count = world.compared = 0;
  if (begin(&bytes, storage, floats, window, channels)) {
    tabulate(window);
    while (bytes.left > 0 && world.count < SAMPLES) {
      feed(&bytes);
    }
    bandPowerReset(&world.bank);
    float none[CHANNELS] = {0}, power[CHANNELS];
    CHECK(bandPowerStep(&world.bank, none, power) == false || window == 1, "after a reset the window is empty");
  }
  free(storage);
  return 0;
}
