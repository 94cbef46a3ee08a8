// fr_cfar.h: any settings and cells, held against a list of all cells and the equation in double.
#include "fr_cfar.h"

#include "fuzz.h"

#define CELLS 700

static double cells[CELLS];

static bool begin(bytes_t *bytes, frCfar_t *cfar, uint16_t leading, uint16_t guard, float *storage, size_t floats) {
  const float pFa = takeByte(bytes) < 128 ? powf(10.0f, -(float)(takeByte(bytes) % 38)) : takeFloat(bytes, 0.2f);
  const bool right =
      leading > 0 && leading + guard <= 32767 && floats >= (size_t)leading + guard && pFa >= FLT_MIN && pFa < 1.0f;
  CHECK(frCfarInit(cfar, leading, guard, pFa, storage, floats) == right, "settings are accepted where they are right");
  if (right) {
    const double factor = expm1(-log((double)pFa) / leading);
    CHECK(fabs(cfar->factor - factor) <= 1e-5 * factor, "the factor gives the probability of false alarm");
  }
  return right;
}

/** The newest cell against the mean of the leading window, which ends `guard` cells before it. */
static void checkCell(const frCfar_t *cfar, int count, bool alert, float threshold) {
  const int lag = cfar->lag, leading = cfar->leadingWindow;
  if (count <= lag) {
    CHECK(isnan(threshold) && !alert, "no threshold before the leading window is full");
    return;
  }
  double sum = 0.0;
  for (int i = count - 1 - lag; i < count - 1 - lag + leading; i++) {
    sum += cells[i];
  }
  const double right = fmin(sum * cfar->factor, FLT_MAX);
  CHECK(fabs(threshold - right) <= (leading + 4) * FLT_EPSILON * right + 1e-44,
        "the threshold is alpha times the mean");
  CHECK(alert == (cells[count - 1] > threshold), "an alert is a cell above its threshold");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  frCfar_t cfar;
  const uint16_t leading = (uint16_t)(takeByte(&bytes) % 70), guard = (uint16_t)(takeByte(&bytes) % 20);
  const uint16_t least = takeByte(&bytes) > 250 ? 1 : 0;
  const size_t floats = FR_CFAR_FLOATS((size_t)leading, (size_t)guard) - (leading + guard > least ? least : 0);
  float *storage = rubbish(floats * sizeof *storage, 0xff);
  if (begin(&bytes, &cfar, leading, guard, storage, floats)) {
    float held = 0.0f;
    uint32_t seed = leading;
    for (int count = 0; bytes.left > 0 && count < CELLS;) {
      const uint8_t kind = takeByte(&bytes);
      for (int i = kind & 1 ? 0 : kind / 2; i >= 0 && count < CELLS; i--) {
        float threshold = -1.0f;
        const float power = kind & 1 ? takeFloat(&bytes, 1.0f) : 1.0f + noise(&seed);
        held = isfinite(power) ? fminf(fmaxf(power, 0.0f), 1e30f) : held;
        cells[count++] = held;
        const bool alert = frCfarStep(&cfar, power, &threshold);
        checkCell(&cfar, count, alert, threshold);
      }
    }
    float threshold;
    frCfarReset(&cfar);
    CHECK(!frCfarStep(&cfar, 1e30f, &threshold) && isnan(threshold), "after a reset no threshold is known");
  }
  free(storage);
  return 0;
}
