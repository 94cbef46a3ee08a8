// Desktop only: whole flights through a windowed network that rolls over them.
// Read by cffi, so nothing but declarations here.
#pragma once

#include "network_batch.h"

// Bytes of arena; 0 where the network cannot roll at this stride. ahead, receptive: samples.
int32_t rollingInt8BatchArena(const flatNetworkInt8_t *flat, int32_t stride, int32_t *ahead, int32_t *receptive);

// A flight: samples rows of quantised input. Where usable[i] is 0 the network is reset. outputs: one row
// a sample, untouched where valid[i] is 0.
void rollingInt8Flight(const flatNetworkInt8_t *flat, const int8_t *inputs, const uint8_t *usable, int32_t samples,
                       int32_t stride, int8_t *arena, int8_t *outputs, uint8_t *valid);

// Inputs on a fixed scale: x[i] of features[i], samples x columns, columns at most 8.
void fixedScaleBatch(const float *mean, const float *inverseDeviation, const float *features, int32_t samples,
                     int32_t columns, float *x);
