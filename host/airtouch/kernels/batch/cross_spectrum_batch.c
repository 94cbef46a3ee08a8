#include "cross_spectrum_batch.h"

#include "cross_spectrum.h"

void crossSpectrumBatch(const float *power, int64_t samples, int32_t channels, const uint16_t *groups,
                        int32_t groupCount, float *feature) {
  for (int64_t i = 0; i < samples; i++) {
    cascadedCrossSpectrum(power + i * channels, groups, (uint16_t)groupCount, feature + i * groupCount);
  }
}
