/**
 * @file cross_spectrum.h
 * CCS-FF: the axes of each sensor fused into one feature,
 * |P_ccs| = sqrt(P_1 P_2 ... P_n), for any number of axes.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: pure functions without state: any number at once.
 * Memory: none; under 100 bytes of stack.
 * Cost: 441 instructions of a Cortex-M4 for nine powers.
 */
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/**
 * The square root of the product of powers. Mantissas are multiplied and
 * exponents added, so nothing overflows or underflows on the way.
 * @return saturated at FLT_MAX; NaN when a power is NaN; negative powers count as 0
 * Costs about 20 operations a power and one square root.
 */
float crossSpectrum(const float *power, uint16_t axes);

/**
 * crossSpectrum() of each group of neighbouring channels.
 * @param power       as many powers as the groups hold in all
 * @param groups      the number of axes of each sensor, each at least 1
 * @param feature     receives `groupCount` features; must not overlap @p power
 */
void cascadedCrossSpectrum(const float *power, const uint16_t *groups, uint16_t groupCount, float *feature);

#ifdef __cplusplus
}
#endif
