/**
 * @file band_power.h
 * FC-FE: mean square of each channel within one frequency band, over the last
 * `window` samples, as a bank of sliding DFTs over the band's bins only.
 *
 * P = 2 / (N sum w^2) sum_k |DFT_k(w (x - mean x))|^2 over the bins
 * low <= k fs / N <= high, w the periodic Hann window: the one-sided power
 * spectral density integrated over the band. Unit: that of x, squared.
 *
 * Each bin is kept in its modulated form: a sample is multiplied by the
 * constant twiddle e^(i 2 pi k n / N) when it enters and when it leaves, so no
 * state is ever rotated and nothing drifts. Every N samples a channel's sums
 * are replaced by ones that have only ever been added to, so that whatever
 * rounding an outlier left is gone after two windows. The latest few samples
 * are summed apart before they join the rest, which rounds less often at full
 * size; channels take turns at both, so that no step is much dearer than
 * another. The window is applied in the frequency domain:
 * 4 X_w[k] = 2 X[k] - X[k-1] - X[k+1].
 *
 * No heap, no global, no division or trigonometry in a step.
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: BAND_POWER_FLOATS floats of the caller's, 10.9 kB for 9 channels at 2 s of 100 Hz.
 * Cost: 3,130 instructions of a Cortex-M4 a step for 9 channels (`python -m tools.instruction_counts.count`).
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Floats of storage for a bank; @p bins counts one neighbour on each side of the band. */
#define BAND_POWER_FLOATS(window, channels, bins) \
  ((window) * ((channels) + 2) + (bins) * ((channels) * 8 + 2) + 2 * (channels))

/** Sums over one bin of one channel. */
typedef struct {
  float re;  ///< over the last N samples
  float im;
  float blockRe;  ///< since the channel's block of N samples began
  float blockIm;
} bandSum_t;

/** A bank of channels. Set up by bandPowerInit(); read nothing but through the functions. */
typedef struct {
  uint16_t window;  ///< N, samples
  uint16_t channels;
  uint16_t firstBin;  ///< the lower neighbour of the band
  uint16_t bins;      ///< of the band and its two neighbours
  uint16_t hop;       ///< samples between two outputs
  uint16_t position;  ///< n mod N of the next sample
  uint16_t phase;     ///< firstBin * n mod N of the next sample
  uint16_t wait;      ///< samples until the next output, once full
  bool started;       ///< a sample has been seen
  bool full;          ///< N samples have been seen
  bool nyquist;       ///< the band ends at half the sample rate
  float scale;        ///< of samples in the sums, about 1 / N
  float gain;         ///< of powers, 1 / (3 N^2 scale^2)
  float *cosine;      ///< N twiddles
  float *sine;
  float *ring;        ///< N samples of all channels
  float *twiddle;     ///< cosine and sine of each bin for the next sample
  float *held;        ///< last finite sample of each channel
  float *reference;   ///< first sample of the channel's block, which its sums are relative to
  bandSum_t *sum;     ///< all bins of channel 0, then of channel 1, ...
  bandSum_t *recent;  ///< likewise: what the latest few samples add
} bandPower_t;

/**
 * Bins that a band needs, neighbours included.
 * @param firstBin  if not NULL, receives the lower neighbour's number
 * @return 0 when the band holds no bin, touches zero frequency or passes half the rate
 */
uint16_t bandPowerBins(float sampleRateHz, uint16_t window, float lowHz, float highHz, uint16_t *firstBin);

/**
 * Sets a bank up.
 * @param storage  BAND_POWER_FLOATS(window, channels, bins) floats that outlive the bank
 * @param floats   how many there are
 * @return false, with the bank unusable, for a window under 4 or over 16384, no
 *         channel, no hop, a band without bins or too little storage
 * Costs 2 N sines; the only place that uses any.
 */
bool bandPowerInit(bandPower_t *self, float sampleRateHz, uint16_t window, float lowHz, float highHz, uint16_t hop,
                   uint16_t channels, float *storage, size_t floats);

/** Forgets every sample; keeps the settings. */
void bandPowerReset(bandPower_t *self);

/**
 * Takes one sample of every channel.
 * @param sample  `channels` values; NaN and infinite ones hold the last finite one
 * @param power   `channels` powers, written only when true is returned
 * @return whether this sample ends a window: at sample N - 1, then every `hop`
 * Costs about 48 instructions a bin and channel of a Cortex-M4; never fails.
 */
bool bandPowerStep(bandPower_t *self, const float *sample, float *power);

#ifdef __cplusplus
}
#endif
