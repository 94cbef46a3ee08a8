// Whole arrays through fr_cfar.h.
#include <stdint.h>

/** Threshold and alert (0 or 1) of each cell; `ring` has leadingWindow + guardCells floats. Returns 0, or -1
 *  for bad settings. */
int32_t frCfarBatch(const float *power, int64_t samples, int32_t leadingWindow, int32_t guardCells, float pFa,
                    float *ring, float *threshold, uint8_t *alert);
/** alpha of these settings, NaN when they are bad; `ring` as above. */
float frCfarFactor(int32_t leadingWindow, int32_t guardCells, float pFa, float *ring);
