// cross_spectrum.h and fixed_scale.h: any powers and features, held against the same in double.
#include "cross_spectrum.h"
#include "fixed_scale.h"

#include "fuzz.h"

#define AXES 600

/** The root of the product of powers as a sum of logarithms; NaN where one of them is. */
static double definition(const float *power, int axes, bool *zero) {
  double logarithm = 0.0;
  *zero = false;
  for (int i = 0; i < axes; i++) {
    if (isnan(power[i])) {
      return NAN;
    }
    *zero = *zero || power[i] <= 0.0f;
    logarithm += power[i] > 0.0f ? 0.5 * log2(fmin(power[i], FLT_MAX)) : 0.0;
  }
  return logarithm;
}

static void checkFeature(const float *power, int axes, float feature) {
  bool zero;
  const double logarithm = definition(power, axes, &zero);
  if (isnan(logarithm)) {
    CHECK(isnan(feature), "a power that is NaN makes the feature NaN");
  } else if (zero) {
    CHECK(feature == 0.0f, "a power of zero, or below, makes the feature zero");
  } else if (logarithm >= 128.0) {
    CHECK(feature == FLT_MAX, "a feature saturates");
  } else {
    const double right = exp2(logarithm), allowed = right * FLT_EPSILON * (axes + 4) + 1.5e-45;
    CHECK(fabs((double)feature - fmin(right, FLT_MAX)) <= allowed, "a feature is the root of the product");
  }
}

static void fuse(bytes_t *bytes) {
  const int groups = 1 + takeByte(bytes) % 4;
  uint16_t size[4];
  int axes = 0;
  const bool large = takeByte(bytes) > 250;
  for (int g = 0; g < groups; g++) {
    size[g] = (uint16_t)(1 + (large ? takeByte(bytes) % 140 : takeByte(bytes) % 5));
    axes += size[g];
  }
  float *power = rubbish((size_t)axes * sizeof *power, 0);
  float *feature = rubbish((size_t)groups * sizeof *feature, 0xff);
  const uint8_t kind = takeByte(bytes);
  for (int i = 0; i < axes; i++) {
    power[i] = kind & 1 ? takeAnyFloat(bytes) : fabsf(takeFloat(bytes, kind & 2 ? 1e-38f : 1e18f));
  }
  cascadedCrossSpectrum(power, size, (uint16_t)groups, feature);
  const float *first = power;
  for (int g = 0; g < groups; g++) {
    checkFeature(first, size[g], feature[g]);
    first += size[g];
  }
  free(feature);
  free(power);
}

static void scale(bytes_t *bytes) {
  fixedScale_t settings = {.columns = 1 + takeByte(bytes) % FIXED_SCALE_MAX_COLUMNS};
  float feature[FIXED_SCALE_MAX_COLUMNS], x[FIXED_SCALE_MAX_COLUMNS];
  for (int i = 0; i < settings.columns; i++) {
    settings.mean[i] = takeFinite(bytes, 10.0f, 100.0f);
    settings.inverseDeviation[i] = takeFinite(bytes, 0.3f, 10.0f);
    feature[i] = takeFloat(bytes, 1.0f);
  }
  fixedScaleApply(&settings, feature, x);
  for (int i = 0; i < settings.columns; i++) {
    const double least = FIXED_SCALE_SMALLEST;
    const double value = feature[i] > least ? fmin(feature[i], 3e38) : least;
    const double right = (log2(value) - settings.mean[i]) * settings.inverseDeviation[i];
    const double limited = fmax(-FIXED_SCALE_LIMIT, fmin(right, FIXED_SCALE_LIMIT));
    const double allowed =
        (3e-7 + FLT_EPSILON * (fabs(log2(value)) + fabs(settings.mean[i]))) * fabs(settings.inverseDeviation[i]) +
        FLT_EPSILON * FIXED_SCALE_LIMIT;
    CHECK(fabs(x[i] - limited) <= allowed, "an input is the feature's logarithm, scaled and clamped");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  for (int i = 0; i == 0 || (i < 8 && bytes.left > 0); i++) {
    fuse(&bytes);
    scale(&bytes);
  }
  return 0;
}
