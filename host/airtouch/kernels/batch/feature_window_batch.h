// Whole arrays through feature_window.h. Row-major.
#include <stdint.h>

/** Per-window z-score of (windows, window, columns); returns 0, or -1 for shapes out of range. */
int32_t zScoreWindowBatch(const float *features, int64_t windows, int32_t window, int32_t columns, float *out);
/** Streaming z-score of (samples, columns). */
void streamingZScoreBatch(const float *features, int64_t samples, int32_t columns, float timeConstant, float *out);
