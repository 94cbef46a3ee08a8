/**
 * @file l1_models.h
 * The networks of gap8/model in L1 of the cluster, weights and all: the cluster's start copies them there.
 */
#pragma once

#include "fixed_scale.h"
#include "network_int8.h"
#include "stream_int8.h"

extern networkInt8_t gap8L1Network;
extern networkInt8_t gap8L1Rolling;
extern fixedScale_t gap8L1RollingScale;
extern streamInt8_t gap8L1Stream;
