/**
 * @file fr_cfar.h
 * FR-CFAR: a threshold for the newest cell from the cells before it alone.
 * T = alpha Z, Z the mean of the leading window, alpha = N (P_FA^(-1/N) - 1).
 *
 *   oldest  [leading window, N cells] [guard cells] [cell under test]  newest
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: FR_CFAR_FLOATS floats of the caller's, 0.3 kB by default.
 * Cost: 248 instructions of a Cortex-M4 a cell, with 50 cells before it.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Floats of storage that frCfarInit() needs. */
#define FR_CFAR_FLOATS(leadingWindow, guardCells) ((leadingWindow) + (guardCells))

/** State of one detector. */
typedef struct {
  uint16_t leadingWindow;  ///< N, cells
  uint16_t lag;            ///< leading window and guard cells
  uint16_t oldest;         ///< ring index of the oldest cell
  uint16_t count;          ///< cells seen, up to lag
  float factor;            ///< alpha / N
  float held;              ///< last finite cell
  float *ring;             ///< lag cells
} frCfar_t;

/**
 * Sets a detector up.
 * @param storage  FR_CFAR_FLOATS(leadingWindow, guardCells) floats that outlive it
 * @return false for an empty leading window, more than 32767 cells, too little storage, or unless
 *         FLT_MIN <= pFa < 1
 */
bool frCfarInit(frCfar_t *self, uint16_t leadingWindow, uint16_t guardCells, float pFa, float *storage, size_t floats);

/**
 * Another probability of false alarm; the cells stay, so the next threshold is known at once.
 * @return false, with nothing changed, unless FLT_MIN <= pFa < 1
 */
bool frCfarSetFalseAlarm(frCfar_t *self, float pFa);

/** Forgets every cell; keeps the settings. */
void frCfarReset(frCfar_t *self);

/**
 * Tests one cell.
 * @param power      not finite: the last finite one is held; clamped to 0..1e30
 * @param threshold  receives T, NaN until the leading window is full
 * @return whether the cell is greater than T
 * Costs N additions: the sum is made anew, so no rounding and no outlier stays in it.
 */
bool frCfarStep(frCfar_t *self, float power, float *threshold);

#ifdef __cplusplus
}
#endif
