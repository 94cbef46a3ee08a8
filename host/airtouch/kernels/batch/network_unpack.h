// Layers out of the flat arrays that cffi hands over. Desktop only.
#pragma once

#include "layer_int8.h"
#include "network_batch.h"

enum { MAX_LAYERS = 32 };

// Fill `layers` (room for MAX_LAYERS) with pointers into the arrays; -1, or the first layer whose
// weights, channels or blocks lie outside them. Whether the layers fit each other is not checked.
int32_t unpackLayersInt8(const flatNetworkInt8_t *flat, layerInt8_t *layers);
