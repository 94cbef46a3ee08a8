// feature_window.h: any features, held against mean and deviation in double.
#include "feature_window.h"
#include "sample_guard.h"

#include "fuzz.h"

#define ROWS 160
#define COLUMNS 4
#define STREAM 200

static float takeFeature(bytes_t *bytes, uint8_t kind, uint32_t *seed) {
  return kind & 1 ? takeFloat(bytes, 3.0f)
                  : (kind & 2 ? 1e6f : 1.0f) * (1.0f + noise(seed) * (kind & 4 ? 1e-6f : 1.0f));
}

static void checkColumn(const float *features, const float *out, int rows, int columns) {
  float held = 0.0f;
  double x[ROWS], mean = 0.0, variance = 0.0, span = 0.0;
  for (int i = 0; i < rows; i++) {
    x[i] = guardSample(features[i * columns], &held);
    mean += (x[i] - x[0]) / rows;
    span = fmax(span, fabs(x[i] - x[0]));
  }
  for (int i = 0; i < rows; i++) {
    variance += (x[i] - x[0] - mean) * (x[i] - x[0] - mean) / rows;
  }
  const double std = sqrt(variance);
  for (int i = 0; i < rows; i++) {
    // Before it divides, the kernel rounds in units of the span; the smallest spans are denormal.
    const double right = std > 0.0 ? (x[i] - x[0] - mean) / std : 0.0;
    const double allowed =
        std > 0.0 ? 1e-6 * rows * (1.0 + fabs(right)) + (span < 1e-36 ? 1.0 + fabs(right) : 0.0) : 0.0;
    CHECK(isfinite(out[i * columns]), "a z-score is a number");
    CHECK(fabs(out[i * columns] - right) <= allowed, "a z-score is the deviation over the standard deviation");
  }
}

static void windows(bytes_t *bytes) {
  const int rows = takeByte(bytes) % (ROWS + 1), columns = takeByte(bytes) % (COLUMNS + 1);
  const uint8_t kind = takeByte(bytes);
  const size_t size = (size_t)rows * (size_t)columns * sizeof(float);
  uint32_t seed = kind;
  float *features = rubbish(size, 0), *out = rubbish(size, 0xff);
  for (int i = 0; i < rows * columns; i++) {
    features[i] = takeFeature(bytes, kind, &seed);
  }
  zScoreWindow(features, (uint16_t)rows, (uint16_t)columns, out);
  for (int c = 0; c < columns && rows > 0; c++) {
    checkColumn(features + c, out + c, rows, columns);
  }
  zScoreWindow(features, (uint16_t)rows, (uint16_t)columns, features);
  CHECK(memcmp(features, out, size) == 0, "in place the result is the same");
  free(out);
  free(features);
}

/** The streaming score against weighted sums over the whole past. */
static void stream(bytes_t *bytes) {
  const float timeConstant = 1.0f + (float)takeByte(bytes);
  const double decay = exp(-1.0 / timeConstant);
  const uint8_t kind = takeByte(bytes);
  uint32_t seed = kind;
  double x[STREAM], largest = 0.0;
  float held = 0.0f;
  bool started = false;
  streamingZScore_t column;
  streamingZScoreInit(&column, timeConstant);
  for (int count = 0; count < STREAM && bytes->left > 0;) {
    const float sample = takeFeature(bytes, kind, &seed);
    const float score = streamingZScoreStep(&column, sample);
    CHECK(isfinite(score), "a streaming z-score is a number");
    started = started || isfinite(sample);
    if (!started) {
      CHECK(score == 0.0f, "nothing is known before the first number");
      continue;
    }
    x[count++] = guardSample(sample, &held);
    double weight = 0.0, mean = 0.0, variance = 0.0, w = 1.0;
    for (int i = count - 1; i >= 0; i--, w *= decay) {
      weight += w;
      mean += w * (x[i] - x[count - 1]);
    }
    mean /= weight;
    w = 1.0;
    for (int i = count - 1; i >= 0; i--, w *= decay) {
      variance += w * (x[i] - x[count - 1] - mean) * (x[i] - x[count - 1] - mean) / weight;
    }
    largest = fmax(largest, fabs(held));
    const double std = sqrt(variance);
    if (std > 1e-16) {
      const double allowed = 1e-5 * count * (largest / std + fabs(mean) / std + 1.0);
      CHECK(fabs(score + mean / std) <= allowed, "it is the deviation over the weighted deviation");
    }
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  if (takeByte(&bytes) & 1) {
    windows(&bytes);
  } else {
    stream(&bytes);
  }
  return 0;
}
