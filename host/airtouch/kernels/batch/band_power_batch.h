// Whole arrays through band_power.h. Row-major; rows are samples.
#include <stdint.h>

/** Floats of work memory that a bank needs, 0 when its settings are out of range. */
int64_t bandPowerWork(float sampleRateHz, int32_t window, float lowHz, float highHz, int32_t channels);
/** Powers of x (samples, channels), one row an output; returns the rows written, -1 for bad settings.
 *  `reset` 0 continues with the state in `state` and `work` (the bank of an earlier call). */
int64_t bandPowerBatch(const float *x, int64_t samples, int32_t channels, float sampleRateHz, int32_t window,
                       float lowHz, float highHz, int32_t hop, void *state, float *work, int64_t floats, int32_t reset,
                       float *power);
/** Bytes of `state`. */
int64_t bandPowerStateSize(void);
