#include "feature_window_batch.h"

#include "feature_window.h"

int32_t zScoreWindowBatch(const float *features, int64_t windows, int32_t window, int32_t columns, float *out) {
  if (window < 1 || window > UINT16_MAX || columns < 0 || columns > UINT16_MAX) {
    return -1;
  }
  const int64_t stride = (int64_t)window * columns;
  for (int64_t i = 0; i < windows; i++) {
    zScoreWindow(features + i * stride, (uint16_t)window, (uint16_t)columns, out + i * stride);
  }
  return 0;
}

void streamingZScoreBatch(const float *features, int64_t samples, int32_t columns, float timeConstant, float *out) {
  for (int32_t c = 0; c < columns; c++) {
    streamingZScore_t column;
    streamingZScoreInit(&column, timeConstant);
    for (int64_t i = 0; i < samples; i++) {
      out[i * columns + c] = streamingZScoreStep(&column, features[i * columns + c]);
    }
  }
}
