// Whole arrays through cross_spectrum.h. Row-major; rows are samples.
#include <stdint.h>

/** Features (samples, groupCount) of powers (samples, channels), channels the sum of the groups. */
void crossSpectrumBatch(const float *power, int64_t samples, int32_t channels, const uint16_t *groups,
                        int32_t groupCount, float *feature);
